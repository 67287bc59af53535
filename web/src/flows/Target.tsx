/** The dot on the sheet where to press next, and the presses that were taken. */

import { toPixels, type View } from "../sheet/view";
import { dot, flow, type Phase } from "./model";

const WORDS: Readonly<Record<Phase, string>> = {
  rest: "Hands off",
  press: "Press here",
  hold: "Hold",
  release: "Let go",
};

export function Target({ view }: { view: View }) {
  const place = dot.value;
  if (!place) return null;
  const [x, y] = toPixels(view, ...place);
  const { phase = "rest", effort, presses = [] } = flow.value;
  return (
    <svg class={`target ${phase}`} width={view.width} height={view.height} aria-hidden="true" data-testid="dot">
      {presses.map((press, k) => {
        const [px, py] = toPixels(view, ...press);
        return <circle key={k} class="taken" cx={px} cy={py} r={4} />;
      })}
      <circle class="ring" cx={x} cy={y} r={20} />
      <circle class="core" cx={x} cy={y} r={7} />
      <text x={x} y={y + 40}>
        {phase === "press" && effort ? `Press ${effort}` : WORDS[phase]}
      </text>
    </svg>
  );
}
