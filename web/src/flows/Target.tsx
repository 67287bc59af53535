/** On the sheet: the dot where to press next, the presses that were taken, the map of a rubbed skin. */

import { toPixels, type View } from "../sheet/view";
import type { RubbedNow } from "../wire";
import { dot, flow, type Phase } from "./model";

const WORDS: Readonly<Record<Phase, string>> = {
  rest: "Hands off",
  press: "Press here",
  hold: "Hold",
  release: "Let go",
  several: "Only one",
  name: "",
  rub: "",
};

function word(): string {
  const { kind, phase, effort } = flow.value;
  if (phase === "press" && kind === "force") return "Here next";
  if (phase === "hold" && kind === "force") return "";
  return phase === "press" && effort ? `Press ${effort}` : WORDS[phase];
}

/** Where the skin has been rubbed: full where it has, rings where it has not. */
function Covered({ view, rubbed }: { view: View; rubbed: RubbedNow }) {
  const { places, covered } = rubbed;
  return (
    <g data-testid="covered" class="covered">
      {covered.map((count, k) => {
        const [x, y] = toPixels(view, places[2 * k], places[2 * k + 1]);
        return <circle key={k} class={count > 0 ? "full" : ""} cx={x} cy={y} r={3} />;
      })}
    </g>
  );
}

export function Target({ view }: { view: View }) {
  const { phase, presses, rubbed, paused } = flow.value;
  const place = dot.value;
  if (paused || (!place && !rubbed)) return null;
  const [x, y] = place ? toPixels(view, ...place) : [0, 0];
  return (
    <svg class={`target ${phase}`} width={view.width} height={view.height} aria-hidden="true" data-testid="dot">
      {rubbed && <Covered view={view} rubbed={rubbed} />}
      {presses.map((press, k) => {
        const [px, py] = toPixels(view, ...press);
        return <circle key={k} class="taken" cx={px} cy={py} r={4} />;
      })}
      {place && (
        <>
          <circle class="ring" cx={x} cy={y} r={20} />
          <circle class="core" cx={x} cy={y} r={7} />
          <text x={x} y={y + 40}>
            {word()}
          </text>
        </>
      )}
    </svg>
  );
}
