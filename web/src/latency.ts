/** How long pictures take on the page: from a frame's arrival to the end of drawing it. */

import { newest, send } from "./state";

const KEPT = 256;
const PERIOD_MS = 1000;

const took = new Float64Array(KEPT);
let count = 0;
let reported = 0;
let drawn = -1;

/** Page time of the first picture that was drawn, ms from the navigation; null before. */
export const first = { at: null as number | null };

/** The newest frame has been drawn. */
export function drewNewest(): void {
  if (!newest.frame || drawn === newest.count) return;
  drawn = newest.count;
  first.at ??= performance.now();
  took[count++ % KEPT] = performance.now() / 1e3 - newest.arrived;
}

/** A part of the sorted times, 0…1. */
export function quantile(sorted: Float64Array, part: number): number {
  return sorted[Math.min(sorted.length - 1, Math.floor(part * sorted.length))];
}

function tell(): void {
  if (count === reported) return;
  reported = count;
  const sorted = took.slice(0, Math.min(count, KEPT)).sort();
  send({ type: "painted", p50_s: quantile(sorted, 0.5), p99_s: quantile(sorted, 0.99) });
}

/** Tell the server once a second; call once. */
export const startTelling = (): void => void window.setInterval(tell, PERIOD_MS);
