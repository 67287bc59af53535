/** How the body stands, where its motion was learnt: an angle in large figures and in words, other coordinates with
 * their deviations. */

import type { Bend } from "../decode";
import { fixed } from "../format";
import { link, shown, status } from "../state";
import { BendFigure } from "../twin/BendFigure";

const WORDS: Readonly<Record<Bend["state"], string>> = {
  idle: "not bent",
  bend: "bent",
  touch: "touched, not bent",
  "bend and touch": "bent and touched",
  unknown: "neither a bend nor a touch explains this",
};

/** The same where no angle was learnt. */
const STATES: typeof WORDS = {
  ...WORDS,
  idle: "at rest",
  bend: "moved",
  touch: "touched, at rest",
  "bend and touch": "moved and touched",
  unknown: "neither the body nor a touch explains this",
};

const degrees = (angle: number, decimals: number): string =>
  `${fixed((angle * 180) / Math.PI, decimals)}°`;

/** The read-out in a sentence. */
export function inWords({ angle, sd, axis, state }: Bend): string {
  if (state === "idle" || state === "touch") return WORDS[state];
  const by = `${degrees(angle, 0)} ± ${degrees(sd, 1)} about an axis ${degrees(axis, 0)} from x`;
  return state === "unknown" ? `${WORDS[state]}; bent by ${by} if anything` : `${WORDS[state]} by ${by}`;
}

/** Decimals that show a deviation with one or two digits. */
const decimalsOf = (sd: number): number => Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(sd))));

/** What the angle does not tell, such as how far a finger swells: each in its own unit. */
function Coordinates() {
  return (status.value?.bend?.coordinates ?? []).map(({ name, value, sd }) => (
    <p class="small" key={name} data-testid="coordinate">
      {name} {fixed(value, decimalsOf(sd))} ± {fixed(sd, decimalsOf(sd))}
    </p>
  ));
}

function Angle({ bend }: { bend: Bend }) {
  return (
    <>
      <p class="unit">bend</p>
      <p class="large" data-testid="bend-angle-read">
        {degrees(bend.angle, 0)}
      </p>
      <p class="small">
        ± {degrees(bend.sd, 1)}, axis {degrees(bend.axis, 0)}
      </p>
      <BendFigure angle={bend.angle} axis={bend.axis} />
    </>
  );
}

export function BendPanel() {
  const bend = shown.value?.referenceReady ? shown.value.bend : null;
  const state = bend?.state ?? (status.value?.bend?.state as Bend["state"] | undefined);
  if (!shown.value?.referenceReady || !state) return null;
  const words = bend ? inWords(bend) : STATES[state];
  return (
    <section
      class={`bending${link.value.phase === "lost" ? " stale" : ""}`}
      aria-label={`Body: ${words}`}
      data-testid="bend"
      data-state={state}
      title={words}
    >
      {bend && <Angle bend={bend} />}
      <Coordinates />
      <p class={state === "unknown" ? "wrong" : "words"} data-testid="bend-words">
        {bend ? WORDS[state] : STATES[state]}
      </p>
    </section>
  );
}
