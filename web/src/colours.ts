/** The scale of a change of conductivity: a fall is blue, a rise red. Its stops are those of the
 * figures too (core/colours.json, which core/colours.py reads). */

import scales from "../../src/tomoskin/core/colours.json";

/** The scale's stops, #rrggbb, on a light and on a dark ground. */
export const CHANGE: Readonly<Record<"light" | "dark", readonly string[]>> = scales.change;

/** Of an amount without a sign, from the least to the most. */
export const AMOUNT: readonly string[] = scales.amount;

/** Odd, so that zero has a colour of its own. */
export const MAP_SIZE = 511;

/** A scale as RGBA bytes from -1 to 1, linear in sRGB between its stops. */
export function mapTable(stops: readonly string[]): Uint8Array {
  const levels = stops.map((stop) => [1, 3, 5].map((k) => Number.parseInt(stop.slice(k, k + 2), 16)));
  const table = new Uint8Array(4 * MAP_SIZE).fill(255);
  for (let k = 0; k < MAP_SIZE; k++) {
    const at = (k / (MAP_SIZE - 1)) * (levels.length - 1);
    const low = Math.min(Math.floor(at), levels.length - 2);
    levels[low].forEach((level, c) => {
      table[4 * k + c] = Math.round(level + (at - low) * (levels[low + 1][c] - level));
    });
  }
  return table;
}

/** The table's entry for a value against its limit. */
export function mapIndex(value: number, limit: number): number {
  const t = Math.min(1, Math.max(-1, value / limit));
  return Math.round((t * 0.5 + 0.5) * (MAP_SIZE - 1));
}
