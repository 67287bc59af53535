/** Which cell of the sheet a place lies in: a grid over the cells, made once for a mesh. */

import type { Topology } from "./topology";

export interface Found {
  readonly cell: number;
  /** Weights of the cell's corners; all of them positive inside it. */
  readonly weights: readonly [number, number, number];
}

/** Weights of corners a, b, c for (x, y). */
function weightsIn(points: ArrayLike<number>, a: number, b: number, c: number, x: number, y: number) {
  const [ax, ay] = [points[2 * a], points[2 * a + 1]];
  const [ux, uy] = [points[2 * b] - ax, points[2 * b + 1] - ay];
  const [vx, vy] = [points[2 * c] - ax, points[2 * c + 1] - ay];
  const det = ux * vy - uy * vx;
  const s = ((x - ax) * vy - (y - ay) * vx) / det;
  const t = (ux * (y - ay) - uy * (x - ax)) / det;
  return [1 - s - t, s, t] as const;
}

export class Locator {
  private readonly buckets: number[][];
  private readonly side: number;
  private readonly low: readonly [number, number];
  private readonly step: readonly [number, number];

  constructor(private readonly topology: Topology) {
    const { points, cells, nCells, nPoints } = topology;
    const low = [Infinity, Infinity];
    const high = [-Infinity, -Infinity];
    for (let k = 0; k < 2 * nPoints; k++) {
      low[k % 2] = Math.min(low[k % 2], points[k]);
      high[k % 2] = Math.max(high[k % 2], points[k]);
    }
    this.side = Math.max(1, Math.ceil(Math.sqrt(nCells / 2)));
    this.low = [low[0], low[1]];
    this.step = [(high[0] - low[0]) / this.side || 1, (high[1] - low[1]) / this.side || 1];
    this.buckets = Array.from({ length: this.side ** 2 }, () => []);
    for (let c = 0; c < nCells; c++) {
      const [i, j, k] = [3 * c, 3 * c + 1, 3 * c + 2].map((at) => cells[at]);
      const xs = [points[2 * i], points[2 * j], points[2 * k]];
      const ys = [points[2 * i + 1], points[2 * j + 1], points[2 * k + 1]];
      const [left, bottom] = this.bucket(Math.min(...xs), Math.min(...ys));
      const [right, top] = this.bucket(Math.max(...xs), Math.max(...ys));
      for (let row = bottom; row <= top; row++) {
        for (let column = left; column <= right; column++) this.buckets[row * this.side + column].push(c);
      }
    }
  }

  /** The cell at (x, y); beyond the rim the nearest that shares its part of the grid, else null. */
  find(x: number, y: number): Found | null {
    const [column, row] = this.bucket(x, y);
    let best: Found | null = null;
    let most = -Infinity;
    for (let ring = 0; ring < this.side && !best; ring++) {
      for (const c of this.around(column, row, ring)) {
        const { cells, points } = this.topology;
        const weights = weightsIn(points, cells[3 * c], cells[3 * c + 1], cells[3 * c + 2], x, y);
        const inside = Math.min(...weights);
        if (inside > most) [most, best] = [inside, { cell: c, weights }];
      }
    }
    return best;
  }

  private *around(column: number, row: number, ring: number): Generator<number> {
    for (let r = Math.max(0, row - ring); r <= Math.min(this.side - 1, row + ring); r++) {
      for (let c = Math.max(0, column - ring); c <= Math.min(this.side - 1, column + ring); c++) {
        yield* this.buckets[r * this.side + c];
      }
    }
  }

  private bucket(x: number, y: number): readonly [number, number] {
    const clamp = (v: number) => Math.min(this.side - 1, Math.max(0, Math.floor(v)));
    return [clamp((x - this.low[0]) / this.step[0]), clamp((y - this.low[1]) / this.step[1])];
  }
}
