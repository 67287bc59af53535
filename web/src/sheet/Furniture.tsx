/** What stands still around the image: the outline, the electrodes, the scale bar. */

import type { Electrode, ElectrodeHealth, Scene } from "../wire";
import { narrow } from "../screen";
import { barLength, boxOf, outward, toPixels, type View } from "./view";

/** From the rim, px: to the middle of a dot; to a label's middle above and below the sheet; to its
 * near end beside it. */
export const LABELS = {
  wide: { dot: 15, middle: 36, beside: 28 },
  narrow: { dot: 8, middle: 23, beside: 16 },
} as const;
type Distances = (typeof LABELS)[keyof typeof LABELS];

interface LabelProps extends Readonly<Record<"x" | "y" | "dx" | "dy", number>> {
  readonly text: string;
  readonly away: Distances;
}

function Label({ text, x, y, dx, dy, away }: LabelProps) {
  const beside = Math.abs(dx) > 0.5;
  const distance = beside ? away.beside : away.middle;
  const anchor = beside ? (dx > 0 ? "start" : "end") : "middle";
  return (
    <text class={anchor} x={x + distance * dx} y={y - distance * dy}>
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
  const [x, y] = narrow.value ? [10, view.height - 8] : [24, view.height - 26];
  return (
    <g class="bar">
      <path d={`M${x} ${y - 5}V${y}H${(x + width).toFixed(1)}V${y - 5}`} />
      <text x={x + width / 2} y={y - 13}>
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

/** A dot where it is well, with its sign while it is driven; a square on its corner, with a cross,
 * where it is not well. */
function Dot({ x, y, sick, sign }: { x: number; y: number; sick: ElectrodeHealth | undefined; sign: string }) {
  if (!sick && sign) {
    return (
      <>
        <circle cx={x} cy={y} r={narrow.value ? 7 : 9} />
        <text class="middle sign" x={x} y={y}>
          {sign}
        </text>
      </>
    );
  }
  if (!sick) return <circle cx={x} cy={y} r={narrow.value ? 4 : 5} />;
  const arm = `M${x - 4} ${y - 4}L${x + 4} ${y + 4}M${x - 4} ${y + 4}L${x + 4} ${y - 4}`;
  return (
    <>
      <rect x={x - 9} y={y - 9} width={18} height={18} transform={`rotate(45 ${x} ${y})`} />
      <path class="cross" d={arm} />
    </>
  );
}

/** Half of the arrow's head, px, and how far it stays from the electrodes. */
const HEAD = 7;
const CLEAR = 12;

/** The current's way: from the source to the sink, inside the sheet. */
function Arrow({ from, to }: Readonly<Record<"from" | "to", readonly [number, number]>>) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (length < 4 * CLEAR) return null;
  const [ex, ey] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
  const [x0, y0] = [from[0] + CLEAR * ex, from[1] + CLEAR * ey];
  const [x1, y1] = [to[0] - CLEAR * ex, to[1] - CLEAR * ey];
  const wing = (side: number) =>
    `${(x1 - 2 * HEAD * ex + side * HEAD * ey).toFixed(1)} ${(y1 - 2 * HEAD * ey - side * HEAD * ex).toFixed(1)}`;
  const path = `M${x0.toFixed(1)} ${y0.toFixed(1)}L${x1.toFixed(1)} ${y1.toFixed(1)}M${wing(1)}L${x1.toFixed(1)} ${y1.toFixed(1)}L${wing(-1)}`;
  return (
    <g class="current" data-testid="current">
      <path class="under" d={path} />
      <path d={path} />
    </g>
  );
}

export interface FurnitureProps {
  readonly scene: Scene;
  readonly view: View;
  readonly sick: readonly ElectrodeHealth[];
  /** Source and sink of the drive that is looked at, counted from 0. */
  readonly drive: readonly [number, number] | null;
  /** Plus and minus of the measurement that is looked at. */
  readonly pair: readonly [number, number] | null;
}

const SIGNS = ["+", "\u2212"];

/** What an electrode does under the measurement that is looked at, beside its name. */
function roles(number: number, drive: FurnitureProps["drive"], pair: FurnitureProps["pair"]): string {
  if (!pair) return "";
  const [role, read] = [drive?.indexOf(number) ?? -1, pair.indexOf(number)];
  return (role < 0 ? "" : ` I${SIGNS[role]}`) + (read < 0 ? "" : ` V${SIGNS[read]}`);
}

/** The same in words. */
function inWords(number: number, { drive, pair }: FurnitureProps): string {
  const [role, read] = [drive?.indexOf(number) ?? -1, pair?.indexOf(number) ?? -1];
  const words = [["source", "sink"][role], ["read plus", "read minus"][read]].filter(Boolean);
  return words.map((word) => `, ${word}`).join("");
}

export function Furniture(props: FurnitureProps) {
  const { scene, view, sick, drive, pair } = props;
  const { outline, points, electrodes } = scene;
  const away = narrow.value ? LABELS.narrow : LABELS.wide;
  const ends = drive?.map((e) => electrodes[e] && toPixels(view, electrodes[e].x, electrodes[e].y));
  return (
    <svg class="furniture" width={view.width} height={view.height} role="group" aria-label="Electrodes">
      <path class="outline" d={`${pathOf(view, outline)}Z`} />
      {scene.electrodes.map((electrode, number) => {
        const [dx, dy] = pixelsOut(scene, view, electrode);
        const [x, y] = toPixels(view, electrode.x, electrode.y);
        const arc = electrode.points.flatMap((p) => [points[2 * p], points[2 * p + 1]]);
        const ill = sick.find((one) => one.electrode === number);
        const health = ill ? ill.reason : "good";
        const reason = `${electrode.label}: ${health}${inWords(number, props)}`;
        const role = pair ? -1 : (drive?.indexOf(number) ?? -1);
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
            <Dot x={x + away.dot * dx} y={y - away.dot * dy} sick={ill} sign={SIGNS[role] ?? ""} />
            <Label
              text={electrode.label + roles(number, drive, pair)}
              x={x}
              y={y}
              dx={dx}
              dy={dy}
              away={away}
            />
          </g>
        );
      })}
      {ends?.[0] && ends[1] && <Arrow from={ends[0]} to={ends[1]} />}
      {!view.seen && <ScaleBar view={view} length={barLength(boxOf(outline))} />}
    </svg>
  );
}
