/** What is drawn over the image each frame: contours, touches, the twin's truth, own presses. */

import type { Touch, Truth } from "../decode";
import type { DeformationNow } from "../wire";
import { rim } from "../faces";
import type { Held } from "../presses";
import type { Theme } from "../theme";
import type { SamePlaces } from "../wire";
import { drawDeformation, drawTrueDeformation, type TrueDeformation } from "./deformed";
import { haloed, type Pen, type Place, within } from "./pen";
import { contours, type Topology } from "./topology";
import { toPixels, type View } from "./view";

export interface Marks {
  readonly touches: readonly Touch[];
  /** Where each has been, oldest first. */
  readonly trails: readonly (readonly Place[])[];
  readonly labels: Uint8Array;
  /** Null: the truth is not asked for. */
  readonly truths: readonly Truth[] | null;
  readonly held: readonly Held[];
  /** The keyboard's place on the sheet, m. */
  readonly cursor: readonly [number, number] | null;
  readonly smoothed: boolean;
  /** The rim, x0, y0, x1, y1, … m: no ellipse and no contour goes beyond it. */
  readonly outline: readonly number[];
  readonly deformation: DeformationNow | null;
  /** Of the twin; null: the truth is not asked for. */
  readonly trueDeformation: TrueDeformation | null;
}

/** Towards the neighbours, then back out a little more: evens a loop without shrinking it
 * (Taubin, SIGGRAPH 1995). */
const PULLS = [0.5, -0.52, 0.5, -0.52, 0.5, -0.52];

/** A closed loop with each corner pulled towards the middle of its neighbours. */
function pulled(loop: readonly Place[], pull: number): Place[] {
  return loop.map(([x, y], k) => {
    const before = loop[(k + loop.length - 1) % loop.length];
    const after = loop[(k + 1) % loop.length];
    return [
      x + pull * ((before[0] + after[0]) / 2 - x),
      y + pull * ((before[1] + after[1]) / 2 - y),
    ];
  });
}

/** A loop of nodes as a path: its edges, or a smooth curve through the middles of its edges. */
function loopPath(loop: number[], topology: Topology, view: View, smoothed: boolean): Path2D {
  const nodes = loop.map((node) =>
    toPixels(view, topology.points[2 * node], topology.points[2 * node + 1]),
  );
  const corners = smoothed ? PULLS.reduce(pulled, nodes) : nodes;
  const path = new Path2D();
  corners.forEach(([x, y], k) => {
    const [nextX, nextY] = corners[(k + 1) % corners.length];
    if (!smoothed) return path.lineTo(x, y);
    const [lastX, lastY] = corners[(k + corners.length - 1) % corners.length];
    if (k === 0) path.moveTo((lastX + x) / 2, (lastY + y) / 2);
    path.quadraticCurveTo(x, y, (x + nextX) / 2, (y + nextY) / 2);
  });
  path.closePath();
  return path;
}

/** χ² of two degrees of freedom that holds 90 %. */
const NINETY = 4.605;
const CORNERS = 40;

/** Half of the longest and of the shortest axis of the ellipse that holds a touch with 90 % of
 * certainty, m; null: unknown. */
export function halfAxes({ sdX, sdY, covXy }: Touch): readonly [number, number] | null {
  const [a, c] = [sdX * sdX, sdY * sdY];
  const middle = (a + c) / 2;
  const spread = Math.hypot((a - c) / 2, covXy);
  if (!Number.isFinite(middle)) return null;
  return [Math.sqrt(NINETY * (middle + spread)), Math.sqrt(NINETY * Math.max(0, middle - spread))];
}

/** That ellipse, in metres around the touch; null: unknown. */
export function ellipse(touch: Touch): readonly Place[] | null {
  const axes = halfAxes(touch);
  if (axes === null) return null;
  const [long, short] = axes;
  const [a, b, c] = [touch.sdX * touch.sdX, touch.covXy, touch.sdY * touch.sdY];
  const angle = Math.atan2(2 * b, a - c) / 2;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return Array.from({ length: CORNERS }, (_, k) => {
    const phase = (2 * Math.PI * k) / CORNERS;
    const [p, q] = [long * Math.cos(phase), short * Math.sin(phase)];
    return [touch.x + p * cos - q * sin, touch.y + p * sin + q * cos] as const;
  });
}

/** Where a touch has been, the older the fainter. */
function drawTrail(pen: Pen, theme: Theme, view: View, trail: readonly Place[]): void {
  pen.strokeStyle = theme.accent;
  pen.lineWidth = 2;
  pen.setLineDash([]);
  for (let k = 1; k < trail.length; k++) {
    pen.globalAlpha = (0.6 * k) / trail.length;
    pen.beginPath();
    pen.moveTo(...toPixels(view, ...trail[k - 1]));
    pen.lineTo(...toPixels(view, ...trail[k]));
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

/** A closed line through places in pixels. */
function closed(places: readonly Place[]): Path2D {
  const path = new Path2D();
  places.forEach(([x, y], k) => (k ? path.lineTo(x, y) : path.moveTo(x, y)));
  path.closePath();
  return path;
}

/** Places on a circle of the sheet, m. */
const circle = (x: number, y: number, radius: number): Place[] =>
  Array.from({ length: CORNERS }, (_, k) => {
    const phase = (2 * Math.PI * k) / CORNERS;
    return [x + radius * Math.cos(phase), y + radius * Math.sin(phase)] as const;
  });

/** From the edge of what presses to its ring, px. */
const TRUTH_GAP = 6;

function drawTouch(pen: Pen, theme: Theme, view: View, touch: Touch): void {
  const [x, y] = toPixels(view, touch.x, touch.y);
  const path = new Path2D();
  const arm = 9;
  path.moveTo(x - arm, y);
  path.lineTo(x + arm, y);
  path.moveTo(x, y - arm);
  path.lineTo(x, y + arm);
  haloed(pen, theme, path, theme.accent, 2, dashesOf(touch));
}

const dashesOf = (touch: Touch): number[] => (touch.provisional ? [5, 4] : []);

/** What holds a touch with 90 % of certainty. */
function drawEllipse(pen: Pen, theme: Theme, view: View, touch: Touch): void {
  const [x, y] = toPixels(view, touch.x, touch.y);
  const ring = ellipse(touch)?.map((place) => toPixels(view, ...place));
  // Not drawn where the cross would hide it.
  if (!ring?.some(([px, py]) => Math.hypot(px - x, py - y) > 3)) return;
  haloed(pen, theme, closed(ring), theme.accent, 2, dashesOf(touch));
}

/** Other places, m, at which the pattern cannot tell the touch from its own; none twice. */
export function elsewhere(touch: Pick<Touch, "x" | "y">, same: SamePlaces | null | undefined): Place[] {
  const places: Place[] = [[touch.x, touch.y]];
  for (const [a, b, c, d, e, f] of same?.maps ?? []) {
    const place = [a * touch.x + b * touch.y + e, c * touch.x + d * touch.y + f] as const;
    const far = places.map(([x, y]) => Math.hypot(x - place[0], y - place[1]));
    if (Math.min(...far) > same!.least_m) places.push(place);
  }
  return places.slice(1);
}

/** A dashed ring where the touch may be as well, with the touch's number. */
function drawElsewhere(pen: Pen, theme: Theme, view: View, touch: Touch, place: Place): void {
  const [x, y] = toPixels(view, ...place);
  const path = new Path2D();
  path.arc(x, y, 9, 0, 2 * Math.PI);
  haloed(pen, theme, path, theme.accent, 2, [3, 3]);
  pen.font = `500 14px ${theme.font}`;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 4;
  pen.lineJoin = "round";
  const text = `or ${touch.id} here`;
  pen.strokeText(text, x + 14, y);
  pen.fillStyle = theme.accent;
  pen.fillText(text, x + 14, y);
}

/** The touch's number on a disc beside its cross. */
function drawNumber(pen: Pen, theme: Theme, view: View, touch: Touch): void {
  const [x, y] = toPixels(view, touch.x, touch.y);
  const text = String(touch.id);
  pen.font = `600 15px ${theme.font}`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const half = Math.max(11, pen.measureText(text).width / 2 + 6);
  const [cx, cy] = [x + 14 + half, y - 20];
  pen.beginPath();
  pen.roundRect(cx - half, cy - 11, 2 * half, 22, 11);
  pen.fillStyle = theme.accent;
  pen.fill();
  pen.fillStyle = theme.halo;
  pen.fillText(text, cx, cy + 1);
  if (!touch.several) return;
  const remark = touch.several > 1 ? `${touch.several} too close` : "too close?";
  pen.font = `500 14px ${theme.font}`;
  pen.textAlign = "left";
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 4;
  pen.lineJoin = "round";
  pen.strokeText(remark, cx + half + 5, cy + 1);
  pen.fillStyle = theme.accent;
  pen.fillText(remark, cx + half + 5, cy + 1);
}

/** Dashes on a band, with a dot in the middle, so that it shows beside and over every other mark. */
function drawTruth(pen: Pen, theme: Theme, view: View, truth: Truth): void {
  const [x, y] = toPixels(view, truth.x, truth.y);
  // Never under the rim of the press that made it.
  const ring = circle(truth.x, truth.y, truth.radius + TRUTH_GAP / view.scale);
  const path = closed(ring.map((place) => toPixels(view, ...place)));
  pen.setLineDash([]);
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 4;
  pen.stroke(path);
  pen.setLineDash([6, 4]);
  pen.strokeStyle = theme.truth;
  pen.lineWidth = 2;
  pen.stroke(path);
  pen.setLineDash([]);
  pen.beginPath();
  pen.ellipse(x, y, 3, 3, 0, 0, 2 * Math.PI);
  pen.fillStyle = theme.truth;
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 1.5;
  pen.fill();
  pen.stroke();
}

/** The first part of a closed line through `corners`, by its length. */
function around(corners: readonly Place[], part: number): Path2D {
  const path = new Path2D();
  const sides = corners.map(([x, y], k) => {
    const [nextX, nextY] = corners[(k + 1) % corners.length];
    return Math.hypot(nextX - x, nextY - y);
  });
  let left = part * sides.reduce((sum, side) => sum + side, 0);
  path.moveTo(...corners[0]);
  for (let k = 0; k < corners.length && left > 0; k++) {
    const [[x, y], [nextX, nextY]] = [corners[k], corners[(k + 1) % corners.length]];
    const gone = Math.min(1, left / (sides[k] || 1));
    path.lineTo(x + gone * (nextX - x), y + gone * (nextY - y));
    left -= sides[k];
  }
  if (part >= 1) path.closePath();
  return path;
}

/** From the rim to the words of the force, px: beyond the truth's ring. */
const FORCE_GAP = 13;

/** The hand's own press: the rim of its probe, drawn as far as its force goes, the force in words. */
function drawHeld(pen: Pen, theme: Theme, view: View, held: Held, maxForce: number): void {
  const [x] = toPixels(view, held.x, held.y);
  const size = Math.max(held.radius, 10 / view.scale);
  const corners = rim(held.face, size, held.angle).map(([dx, dy]) =>
    toPixels(view, held.x + dx, held.y + dy),
  );
  const lowest = Math.max(...corners.map(([, cy]) => cy));
  haloed(pen, theme, around(corners, 1), theme.muted, 1);
  haloed(pen, theme, around(corners, held.force / maxForce), theme.ink, 3);
  pen.font = `500 14px ${theme.font}`;
  pen.textAlign = "center";
  pen.textBaseline = "top";
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 4;
  pen.lineJoin = "round";
  const grows = held.growing && held.force < maxForce ? ", grows while held" : "";
  const text = `pressed with ${held.force.toFixed(1)} N${grows}`;
  pen.strokeText(text, x, lowest + FORCE_GAP);
  pen.fillStyle = theme.ink;
  pen.fillText(text, x, lowest + FORCE_GAP);
}

function drawCursor(pen: Pen, theme: Theme, view: View, place: readonly [number, number]): void {
  const [x, y] = toPixels(view, ...place);
  const path = new Path2D();
  path.arc(x, y, 12, 0, 2 * Math.PI);
  path.moveTo(x + 2, y);
  path.arc(x, y, 2, 0, 2 * Math.PI);
  haloed(pen, theme, path, theme.ink, 1.5);
}

/** The regions that touches cover, and the ellipses that hold them. */
function drawRegions(pen: Pen, theme: Theme, view: View, topology: Topology, marks: Marks): void {
  if (marks.touches.length === 0) return;
  for (const region of contours(topology, marks.labels, marks.touches.length)) {
    for (const loop of region) {
      haloed(pen, theme, loopPath(loop, topology, view, marks.smoothed), theme.accent, 1.5);
    }
  }
  for (const touch of marks.touches) drawEllipse(pen, theme, view, touch);
}

/** Draw all marks on a cleared canvas. */
export function drawMarks(
  pen: Pen,
  theme: Theme,
  view: View,
  topology: Topology,
  marks: Marks,
  maxForce: number,
  same: SamePlaces | null = null,
): void {
  const density = pen.canvas.width / view.width;
  pen.setTransform(density, 0, 0, density, 0, 0);
  pen.clearRect(0, 0, view.width, view.height);
  const ground = { pen, theme, view, outline: marks.outline };
  if (marks.deformation) drawDeformation(ground, marks.deformation);
  if (marks.trueDeformation) drawTrueDeformation(ground, marks.trueDeformation);
  pen.setLineDash([]);
  within(pen, view, marks.outline, () => drawRegions(pen, theme, view, topology, marks));
  for (const trail of marks.trails) drawTrail(pen, theme, view, trail);
  for (const held of marks.held) drawHeld(pen, theme, view, held, maxForce);
  for (const touch of marks.touches) drawTouch(pen, theme, view, touch);
  for (const truth of marks.truths ?? []) drawTruth(pen, theme, view, truth);
  for (const touch of marks.touches) {
    for (const place of elsewhere(touch, same)) drawElsewhere(pen, theme, view, touch, place);
  }
  for (const touch of marks.touches) drawNumber(pen, theme, view, touch);
  if (marks.cursor) drawCursor(pen, theme, view, marks.cursor);
}
