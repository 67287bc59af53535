/** How the sheet is deformed: a fold as a line with its angle, a stretch as arrows along its axis; the
 * twin's own beside it. */

import { fixed } from "../format";
import type { Theme } from "../theme";
import type { DeformationNow, EstimatedNow, TwinBend, TwinStretch } from "../wire";
import { haloed, type Pen, type Place, within, written } from "./pen";
import { boxOf, toPixels, type View } from "./view";

type Line = readonly [Place, Place];

const DEGREE = Math.PI / 180;

/** Along an axis, rad from x; and to the right of it. */
const along = (axis: number): Place => [Math.cos(axis), Math.sin(axis)];
const right = (axis: number): Place => [Math.sin(axis), -Math.cos(axis)];

/** The first and the last place at which a line crosses the rim, x0, y0, x1, y1, …; null: it misses. */
export function chord(outline: readonly number[], [x, y]: Place, [dx, dy]: Place): Line | null {
  const met: number[] = [];
  for (let k = 0; k < outline.length; k += 2) {
    const [ax, ay] = [outline[k] - x, outline[k + 1] - y];
    const next = (k + 2) % outline.length;
    const [ex, ey] = [outline[next] - outline[k], outline[next + 1] - outline[k + 1]];
    const cross = dx * ey - dy * ex;
    const part = (ax * dy - ay * dx) / cross;
    if (part >= 0 && part < 1) met.push((ax * ey - ay * ex) / cross);
  }
  if (met.length < 2) return null;
  const [first, last] = [Math.min(...met), Math.max(...met)];
  return [
    [x + first * dx, y + first * dy],
    [x + last * dx, y + last * dy],
  ];
}

/** The line of a fold on the sheet. */
export function foldLine(outline: readonly number[], axis: number, offset: number): Line | null {
  const [x, y] = right(axis);
  return chord(outline, [offset * x, offset * y], along(axis));
}

/** From the middle outwards, in parts of the sheet's smaller half: where the two arrows of a stretch
 * begin and end. */
const FROM = 0.3;
const TO = 0.7;

/** Two arrows along an axis, away from each other where the sheet is longer there. */
export function stretchArrows(outline: readonly number[], axis: number, longer: boolean): readonly Line[] {
  const { left, right: end, bottom, top } = boxOf(outline);
  const [x, y] = [(left + end) / 2, (bottom + top) / 2];
  const half = Math.min(end - left, top - bottom) / 2;
  const [dx, dy] = along(axis);
  return [1, -1].map((side) => {
    const at = (part: number): Place => [x + side * part * half * dx, y + side * part * half * dy];
    return longer ? [at(FROM), at(TO)] : [at(TO), at(FROM)];
  });
}

const signed = (value: number, decimals: number): string => (value > 0 ? "+" : "") + fixed(value, decimals);

/** A number with its interval, each times so much. */
function interval({ value, low, high }: EstimatedNow, times: number, decimals: number, unit: string): string {
  if (value === null || low === null || high === null) return "";
  const [most, from, to] = [value, low, high].map((one) => signed(times * one, decimals));
  return `${most}${unit} (${from} to ${to})`;
}

/** How much, with its interval. */
function amountInWords({ unit, amount }: DeformationNow): string {
  if (!amount) return "";
  if (unit === "rad") return `, ${interval(amount, 1 / DEGREE, 0, "°")}`;
  return `, ${unit === "strain" ? "" : "conductance "}${interval(amount, 100, 1, " %")}`;
}

/** What stands beside the drawing. */
export function deformationInWords(deformation: DeformationNow): string {
  const { kind, axis } = deformation;
  if (axis?.value == null || axis.high == null) return "";
  const [angle, off] = [axis.value / DEGREE, (axis.high - axis.value) / DEGREE];
  const name = kind === "fold" ? "Fold at" : "Stretch along";
  return `${name} ${fixed(angle, 0)}° ± ${fixed(off, 0)}°${amountInWords(deformation)}`;
}

function arrow(view: View, [from, to]: Line): Path2D {
  const [[x0, y0], [x1, y1]] = [toPixels(view, ...from), toPixels(view, ...to)];
  const length = Math.hypot(x1 - x0, y1 - y0) || 1;
  const [ex, ey] = [(x1 - x0) / length, (y1 - y0) / length];
  const path = new Path2D();
  path.moveTo(x0, y0);
  path.lineTo(x1, y1);
  for (const side of [1, -1]) {
    path.moveTo(x1 - 14 * ex + side * 8 * ey, y1 - 14 * ey - side * 8 * ex);
    path.lineTo(x1, y1);
  }
  return path;
}

function straight(view: View, [from, to]: Line): Path2D {
  const path = new Path2D();
  path.moveTo(...toPixels(view, ...from));
  path.lineTo(...toPixels(view, ...to));
  return path;
}

/** Of what was measured, px: it shows beside the twin's own where the two agree. */
const WIDTH = 5;
/** Dashes, for what the twin really does. */
const TRUE_DASHES = [6, 4];

interface Ground {
  readonly pen: Pen;
  readonly theme: Theme;
  readonly view: View;
  readonly outline: readonly number[];
}

/** From the middle of the sheet's top or bottom to words, px. */
const INSET = 36;
const LINE = 20;

function above({ view, outline }: Ground, lines: number): Place {
  const { left, right: end, bottom, top } = boxOf(outline);
  const [x, y] = toPixels(view, (left + end) / 2, lines > 0 ? top : bottom);
  return [x, y + lines * INSET];
}

/** What was measured. */
export function drawDeformation(ground: Ground, deformation: DeformationNow): void {
  const { pen, theme, view, outline } = ground;
  const { kind, axis, offset, amount } = deformation;
  if (axis?.value == null) return;
  within(pen, view, outline, () => {
    if (kind === "fold" && offset?.value != null) {
      const line = foldLine(outline, axis.value ?? 0, offset.value);
      if (line) haloed(pen, theme, straight(view, line), theme.accent, WIDTH);
    } else if (kind === "stretch") {
      // Of a skin that does not say how it answers strain, the axis is all that is known.
      const longer = deformation.unit !== "strain" || (amount?.value ?? 0) >= 0;
      for (const one of stretchArrows(outline, axis.value ?? 0, longer)) {
        haloed(pen, theme, arrow(view, one), theme.accent, WIDTH);
      }
    }
  });
  // Two lines, which fit between the electrodes of a disc.
  const [x, y] = above(ground, 1);
  deformationInWords(deformation)
    .split(", ")
    .forEach((line, k) => written(pen, theme, line, [x, y + k * LINE], theme.accent));
}

export interface TrueDeformation {
  readonly bend: TwinBend | null;
  readonly stretch: TwinStretch | null;
}

/** What the twin really does, in words. */
export function truthInWords({ bend, stretch }: TrueDeformation): string {
  const words: string[] = [];
  if (bend) words.push(`bent by ${signed(bend.angle / DEGREE, 0)}° at ${fixed(bend.axis / DEGREE, 0)}°`);
  if (stretch) words.push(`stretched by ${signed(100 * stretch.along, 1)} % along ${fixed(stretch.axis / DEGREE, 0)}°`);
  return words.length ? `Truth: ${words.join(", ")}` : "";
}

/** The same drawn. */
export function drawTrueDeformation(ground: Ground, truth: TrueDeformation): void {
  const { pen, theme, view, outline } = ground;
  const { bend, stretch } = truth;
  within(pen, view, outline, () => {
    const line = bend && foldLine(outline, bend.axis, bend.offset);
    if (line) haloed(pen, theme, straight(view, line), theme.truth, 2, TRUE_DASHES);
    const arrows = stretch ? stretchArrows(outline, stretch.axis, stretch.along >= 0) : [];
    for (const one of arrows) haloed(pen, theme, arrow(view, one), theme.truth, 2, TRUE_DASHES);
  });
  pen.setLineDash([]);
  const words = truthInWords(truth);
  if (words) written(pen, theme, words, above(ground, -1), theme.truth);
}
