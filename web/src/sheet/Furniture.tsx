/** What stands still around the image: the outline, the electrodes, the scale bar. */

import type { Electrode, Scene, Sick } from "../protocol";
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

/** Out of the sheet at an electrode, in pixels right and up. */
function pixelsOut(scene: Scene, view: View, electrode: Electrode): readonly [number, number] {
  const [dx, dy] = outward(scene.outline, scene.points, electrode);
  const inside = 2e-3;
  const [x, y] = toPixels(view, electrode.x, electrode.y);
  const [x0, y0] = toPixels(view, electrode.x - inside * dx, electrode.y - inside * dy);
  const length = Math.hypot(x - x0, y - y0) || 1;
  return [(x - x0) / length, (y0 - y) / length];
}

/** A dot where it is well; a square on its corner, with a cross, where it is not. */
function Dot({ x, y, sick }: { x: number; y: number; sick: Sick | undefined }) {
  if (!sick) return <circle cx={x} cy={y} r={5} />;
  const arm = `M${x - 4} ${y - 4}L${x + 4} ${y + 4}M${x - 4} ${y + 4}L${x + 4} ${y - 4}`;
  return (
    <>
      <rect x={x - 9} y={y - 9} width={18} height={18} transform={`rotate(45 ${x} ${y})`} />
      <path class="cross" d={arm} />
    </>
  );
}

export interface FurnitureProps {
  readonly scene: Scene;
  readonly view: View;
  readonly sick: readonly Sick[];
  /** Source and sink of the drive that is looked at, counted from 0. */
  readonly drive: readonly [number, number] | null;
  /** Plus and minus of the measurement that is looked at. */
  readonly pair: readonly [number, number] | null;
}

const SIGNS = ["+", "\u2212"];

/** What an electrode does under the drive and measurement that are looked at. */
function roles(number: number, drive: FurnitureProps["drive"], pair: FurnitureProps["pair"]): string {
  const [role, read] = [drive?.indexOf(number) ?? -1, pair?.indexOf(number) ?? -1];
  const driven = role < 0 ? "" : ` ${pair ? "I" : ""}${SIGNS[role]}`;
  return driven + (read < 0 ? "" : ` V${SIGNS[read]}`);
}


export function Furniture({ scene, view, sick, drive, pair }: FurnitureProps) {
  const { outline, points } = scene;
  return (
    <svg class="furniture" width={view.width} height={view.height} role="group" aria-label="Electrodes">
      <path class="outline" d={`${pathOf(view, outline)}Z`} />
      {scene.electrodes.map((electrode, number) => {
        const [dx, dy] = pixelsOut(scene, view, electrode);
        const [x, y] = toPixels(view, electrode.x, electrode.y);
        const arc = electrode.points.flatMap((p) => [points[2 * p], points[2 * p + 1]]);
        const ill = sick.find((one) => one.electrode === number);
        const reason = ill ? `${electrode.label}: ${ill.reason}` : `${electrode.label}: good`;
        const driven = drive?.includes(number) ?? false;
        const read = pair?.includes(number) ?? false;
        return (
          <g
            key={electrode.label}
            class={`electrode${ill ? " ill" : ""}${driven ? " driven" : ""}${read ? " read" : ""}`}
            data-testid={`electrode-${number + 1}`}
            role="img"
            aria-label={reason}
            {...(ill ? { tabIndex: 0 } : {})}
          >
            <title>{reason}</title>
            {arc.length > 2 && <path class="arc" d={pathOf(view, arc)} />}
            <Dot x={x + DOT * dx} y={y - DOT * dy} sick={ill} />
            <Label
              text={electrode.label + roles(number, drive, pair)}
              x={x}
              y={y}
              dx={dx}
              dy={dy}
            />
          </g>
        );
      })}
      {!view.seen && <ScaleBar view={view} length={barLength(boxOf(outline))} />}
    </svg>
  );
}
