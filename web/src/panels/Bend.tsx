/** How the sheet is bent, where its bends were learnt: the angle in large figures, and in words. */

import type { Bend } from "../decode";
import { fixed } from "../format";
import { link, shown } from "../state";
import { BendFigure } from "../twin/BendFigure";

const WORDS: Readonly<Record<Bend["state"], string>> = {
  idle: "not bent",
  bend: "bent",
  touch: "touched, not bent",
  "bend and touch": "bent and touched",
  unknown: "neither a bend nor a touch explains this",
};

const degrees = (angle: number, decimals: number): string =>
  `${fixed((angle * 180) / Math.PI, decimals)}°`;

/** The read-out in a sentence. */
export function inWords({ angle, sd, axis, state }: Bend): string {
  if (state === "idle" || state === "touch") return WORDS[state];
  const by = `${degrees(angle, 0)} ± ${degrees(sd, 1)} about an axis ${degrees(axis, 0)} from x`;
  return state === "unknown" ? `${WORDS[state]}; bent by ${by} if anything` : `${WORDS[state]} by ${by}`;
}

export function BendPanel() {
  const bend = shown.value?.referenceReady ? shown.value.bend : null;
  if (!bend) return null;
  return (
    <section
      class={`bending${link.value.phase === "lost" ? " stale" : ""}`}
      aria-label={`Bend: ${inWords(bend)}`}
      data-testid="bend"
      data-state={bend.state}
      title={inWords(bend)}
    >
      <p class="unit">bend</p>
      <p class="large" data-testid="bend-angle-read">
        {degrees(bend.angle, 0)}
      </p>
      <p class="small">
        ± {degrees(bend.sd, 1)}, axis {degrees(bend.axis, 0)}
      </p>
      <BendFigure angle={bend.angle} axis={bend.axis} />
      <p class={bend.state === "unknown" ? "wrong" : "words"} data-testid="bend-words">
        {WORDS[bend.state]}
      </p>
    </section>
  );
}
