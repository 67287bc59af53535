/** What stands still around the image: the outline, the electrodes, the scale bar. */

import type { Scene } from "../protocol";
import { barLength, boxOf, outward, toPixels, type View } from "./view";

const DOT = 15;
/** From the rim to a label's middle above and below the sheet, to its near end beside it. */
const LABEL = 36;
const SIDE_LABEL = 28;

function Label({ text, x, y, dx, dy }: Record<"x" | "y" | "dx" | "dy", number> & { text: string }) {
  const beside = Math.abs(dx) > 0.5;
  const away = beside ? SIDE_LABEL : LABEL;
  const anchor = beside ? (dx > 0 ? "start" : "end") : "middle";
  return (
    <text class={anchor} x={x + away * dx} y={y - away * dy}>
      {text}
    </text>
  );
}

function pathOf(view: View, flat: readonly number[]): string {
  const pairs: string[] = [];
  for (let k = 0; k < flat.length; k += 2) {
    pairs.push(toPixels(view, flat[k], flat[k + 1]).map((v) => v.toFixed(1)).join(" "));
  }
  return `M${pairs.join("L")}`;
}

function ScaleBar({ view, length }: { view: View; length: number }) {
  const width = length * view.scale;
  const y = view.height - 26;
  return (
    <g class="bar">
      <path d={`M24 ${y - 5}V${y}H${(24 + width).toFixed(1)}V${y - 5}`} />
      <text x={24 + width / 2} y={y - 13}>
        {length >= 0.01 ? `${length * 100} cm` : `${length * 1000} mm`}
      </text>
    </g>
  );
}

export function Furniture({ scene, view }: { scene: Scene; view: View }) {
  const { outline, points } = scene;
  return (
    <svg class="furniture" width={view.width} height={view.height} aria-hidden="true">
      <path class="outline" d={`${pathOf(view, outline)}Z`} />
      {scene.electrodes.map((electrode) => {
        const [dx, dy] = outward(outline, points, electrode);
        const [x, y] = toPixels(view, electrode.x, electrode.y);
        const arc = electrode.points.flatMap((p) => [points[2 * p], points[2 * p + 1]]);
        return (
          <g key={electrode.label} class="electrode">
            {arc.length > 2 && <path d={pathOf(view, arc)} />}
            <circle cx={x + DOT * dx} cy={y - DOT * dy} r={5} />
            <Label text={electrode.label} x={x} y={y} dx={dx} dy={dy} />
          </g>
        );
      })}
      <ScaleBar view={view} length={barLength(boxOf(outline))} />
    </svg>
  );
}
