/** Metres on the sheet to pixels on the page and back, true to scale; y points up on the sheet. */

import type { Seen } from "./solid";

export interface Box {
  readonly left: number;
  readonly right: number;
  readonly bottom: number;
  readonly top: number;
}

export interface View {
  /** Pixels per metre. */
  readonly scale: number;
  /** The sheet's origin in pixels from the top left. */
  readonly originX: number;
  readonly originY: number;
  readonly width: number;
  readonly height: number;
  /** The sheet in space; without it the sheet lies flat. */
  readonly seen?: Seen;
}

export interface Margin {
  readonly left: number;
  readonly right: number;
  readonly top: number;
  readonly bottom: number;
}

/** The box around flat x, y pairs. */
export function boxOf(points: readonly number[]): Box {
  let left = Infinity;
  let right = -Infinity;
  let bottom = Infinity;
  let top = -Infinity;
  for (let k = 0; k < points.length; k += 2) {
    left = Math.min(left, points[k]);
    right = Math.max(right, points[k]);
    bottom = Math.min(bottom, points[k + 1]);
    top = Math.max(top, points[k + 1]);
  }
  return { left, right, bottom, top };
}

/** The largest view of a box that leaves the margins free. */
export function fit(box: Box, width: number, height: number, margin: Margin): View {
  const room = [width - margin.left - margin.right, height - margin.top - margin.bottom];
  const scale = Math.max(
    1e-6,
    Math.min(room[0] / (box.right - box.left), room[1] / (box.top - box.bottom)),
  );
  return {
    scale,
    originX: margin.left + room[0] / 2 - ((box.left + box.right) / 2) * scale,
    originY: margin.top + room[1] / 2 + ((box.bottom + box.top) / 2) * scale,
    width,
    height,
  };
}

/** A view of a sheet in space in which it stays when it is turned. */
export function around(seen: Seen, width: number, height: number, margin: Margin): View {
  const { radius } = seen;
  const box = { left: -radius, right: radius, bottom: -radius, top: radius };
  return { ...fit(box, width, height, margin), seen };
}

export function toPixels(view: View, x: number, y: number): readonly [number, number] {
  const [right, up] = view.seen ? view.seen.at(x, y) : [x, y];
  return [view.originX + right * view.scale, view.originY - up * view.scale];
}

/** The place under a pixel; NaN beside a sheet in space. */
export function toSheet(view: View, px: number, py: number): readonly [number, number] {
  const [right, up] = [(px - view.originX) / view.scale, (view.originY - py) / view.scale];
  if (!view.seen) return [right, up];
  return view.seen.pick(right, up) ?? [Number.NaN, Number.NaN];
}

/** Whether a point lies inside a closed outline of flat x, y pairs (even-odd rule). */
export function contains(outline: readonly number[], x: number, y: number): boolean {
  let inside = false;
  const n = outline.length;
  for (let k = 0, j = n - 2; k < n; j = k, k += 2) {
    const above = outline[k + 1] > y;
    if (above === outline[j + 1] > y) continue;
    const crossing =
      ((outline[j] - outline[k]) * (y - outline[k + 1])) / (outline[j + 1] - outline[k + 1]);
    if (x < outline[k] + crossing) inside = !inside;
  }
  return inside;
}

/** The unit vector out of the outline at an electrode. */
export function outward(
  outline: readonly number[],
  points: readonly number[],
  electrode: { readonly x: number; readonly y: number; readonly points: readonly number[] },
): readonly [number, number] {
  const first = electrode.points[0] ?? -1;
  const last = electrode.points[electrode.points.length - 1] ?? -1;
  const box = boxOf(outline);
  let dx = electrode.x - (box.left + box.right) / 2;
  let dy = electrode.y - (box.bottom + box.top) / 2;
  if (first !== last) {
    dx = points[2 * last + 1] - points[2 * first + 1];
    dy = points[2 * first] - points[2 * last];
  }
  const length = Math.hypot(dx, dy) || 1;
  const nudge = 0.02 * (box.right - box.left + box.top - box.bottom);
  const sign = contains(
    outline,
    electrode.x + (nudge * dx) / length,
    electrode.y + (nudge * dy) / length,
  )
    ? -1
    : 1;
  return [(sign * dx) / length, (sign * dy) / length];
}

/** The length of the scale bar: 5 cm, or a round shorter one where the sheet is small. */
export function barLength(box: Box): number {
  const size = Math.max(box.right - box.left, box.top - box.bottom);
  return [0.05, 0.02, 0.01, 0.005, 0.002, 0.001].find((bar) => bar <= 0.6 * size) ?? 0.001;
}
