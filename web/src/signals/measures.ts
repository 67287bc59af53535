/** What the voltages say of themselves: noise of each row, reciprocity, drift over time. */

import type { PatternRows } from "../wire";

/** Frames over which noise is averaged. */
const MEMORY = 64;

/** Noise of each row from the differences of successive frames (von Neumann 1941), which drift and
 * a steady touch do not enter: their mean square is twice the variance. */
export class NoiseMeter {
  private last: Float32Array | null = null;
  private squares = new Float64Array();
  private count = 0;

  add(voltages: Float32Array): void {
    if (this.last?.length !== voltages.length) {
      this.squares = new Float64Array(voltages.length);
      this.last = Float32Array.from(voltages);
      this.count = 0;
      return;
    }
    this.count = Math.min(MEMORY, this.count + 1);
    for (let k = 0; k < voltages.length; k++) {
      const step = voltages[k] - this.last[k];
      this.squares[k] += (step * step - this.squares[k]) / this.count;
    }
    this.last.set(voltages);
  }

  /** Standard deviation of a row, V; NaN until there are enough frames. */
  of(row: number): number {
    return this.count < 8 ? Number.NaN : Math.sqrt(this.squares[row] / 2);
  }
}

/** Pairs of rows that must read alike: drive and measurement exchanged. Sign −1: with the other sign. */
export function reciprocalPairs(pattern: PatternRows): readonly (readonly [number, number, number])[] {
  const known = new Map<string, readonly [number, number]>();
  const pairs: (readonly [number, number, number])[] = [];
  const ordered = (a: number, b: number) => (a < b ? ([a, b, 1] as const) : ([b, a, -1] as const));
  for (let row = 0; row < pattern.n_meas; row++) {
    const [a, b, s] = ordered(pattern.drive[2 * row], pattern.drive[2 * row + 1]);
    const [c, d, t] = ordered(pattern.measure[2 * row], pattern.measure[2 * row + 1]);
    const twin = known.get(`${c} ${d} ${a} ${b}`);
    if (twin) pairs.push([twin[0], row, twin[1] * s * t]);
    else known.set(`${a} ${b} ${c} ${d}`, [row, s * t]);
  }
  return pairs;
}

/** Differences of reciprocal rows as a part of their mean size. */
export function reciprocity(
  pairs: readonly (readonly [number, number, number])[],
  voltages: ArrayLike<number>,
): number[] {
  let size = 0;
  for (const [a, b] of pairs) size += (Math.abs(voltages[a]) + Math.abs(voltages[b])) / (2 * pairs.length);
  return pairs.map(([a, b, sign]) => (size > 0 ? (voltages[a] - sign * voltages[b]) / size : 0));
}

/** One value every few seconds, the oldest forgotten. */
export class Log {
  readonly times: number[] = [];
  readonly values: (number | null)[] = [];

  constructor(
    private readonly period: number,
    private readonly most: number,
  ) {}

  add(time: number, value: number | null): void {
    const last = this.times[this.times.length - 1];
    if (last !== undefined && time - last < this.period) return;
    this.times.push(time);
    this.values.push(value);
    if (this.times.length <= this.most) return;
    this.times.shift();
    this.values.shift();
  }

  clear(): void {
    this.times.length = this.values.length = 0;
  }
}
