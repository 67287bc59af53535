/** A sheet on a surface, seen from somewhere: places on it to pixels, and rays back to places. */

import { Locator } from "./locate";
import type { Topology } from "./topology";

/** Where one looks from, rad: around the upright axis, and how far from above. */
export interface Orbit {
  readonly turn: number;
  readonly tilt: number;
}

export const FIRST_ORBIT: Orbit = { turn: 0.5, tilt: 0.9 };

/** Rows: right, up, towards the eye. The sheet's front looks along +z. */
export function rotation({ turn, tilt }: Orbit): readonly number[] {
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  const [ct, st] = [Math.cos(tilt), Math.sin(tilt)];
  return [c, -s, 0, s * ct, c * ct, st, -s * st, -c * st, ct];
}

/** Where light comes from: the upper left, before the sheet; and how much it does. */
const LIGHT = [-0.5, 0.62, 0.6];
const CONTRAST = 0.9;

/** What one sees of a solid, in units of the sheet. */
export class Seen {
  private own: Float32Array | null = null;

  private constructor(
    private readonly topology: Topology,
    private readonly locator: Locator,
    /** x right, y up, z towards the eye, of every node. */
    readonly places: Float32Array,
    readonly radius: number,
    /** Of every node what light a dent lends it, 1 where there is none. */
    readonly lit: Float32Array | null = null,
  ) {}

  /** The sheet whose nodes are at `points` in space, turned by `matrix`. */
  static of(topology: Topology, locator: Locator, points: ArrayLike<number>, matrix: readonly number[]): Seen {
    const middle = middleOf(points);
    const places = new Float32Array(points.length);
    let radius = 0;
    for (let k = 0; k < points.length; k += 3) {
      const [x, y, z] = [points[k] - middle[0], points[k + 1] - middle[1], points[k + 2] - middle[2]];
      radius = Math.max(radius, Math.hypot(x, y, z));
      for (let row = 0; row < 3; row++) {
        places[k + row] = matrix[3 * row] * x + matrix[3 * row + 1] * y + matrix[3 * row + 2] * z;
      }
    }
    return new Seen(topology, locator, places, radius);
  }

  /** The same where each node has given way by so much: `counts` of `step` m. */
  dented(counts: Uint16Array, step: number): Seen {
    this.own ??= normalsOf(this.topology, this.places);
    const places = this.places.map((at, k) => at - step * counts[Math.floor(k / 3)] * (this.own?.[k] ?? 0));
    const tilted = normalsOf(this.topology, places);
    const lit = new Float32Array(counts.length);
    for (let n = 0; n < lit.length; n++) {
      let more = 0;
      for (let axis = 0; axis < 3; axis++) more += LIGHT[axis] * (tilted[3 * n + axis] - this.own[3 * n + axis]);
      lit[n] = Math.max(0.35, 1 + CONTRAST * more);
    }
    return new Seen(this.topology, this.locator, places, this.radius, lit);
  }

  /** Right and up of a place on the sheet. */
  at(u: number, v: number): readonly [number, number] {
    const found = this.locator.find(u, v);
    if (!found) return [0, 0];
    let [x, y] = [0, 0];
    found.weights.forEach((weight, k) => {
      const node = this.topology.cells[3 * found.cell + k];
      x += weight * this.places[3 * node];
      y += weight * this.places[3 * node + 1];
    });
    return [x, y];
  }

  /** The place on the sheet that is nearest to the eye there, or null beside the sheet. */
  pick(x: number, y: number): readonly [number, number] | null {
    const { cells, nCells, points } = this.topology;
    let best: readonly [number, number] | null = null;
    let nearest = -Infinity;
    for (let c = 0; c < nCells; c++) {
      const [i, j, k] = [cells[3 * c], cells[3 * c + 1], cells[3 * c + 2]];
      const [ax, ay] = [this.places[3 * i], this.places[3 * i + 1]];
      const [ux, uy] = [this.places[3 * j] - ax, this.places[3 * j + 1] - ay];
      const [vx, vy] = [this.places[3 * k] - ax, this.places[3 * k + 1] - ay];
      const det = ux * vy - uy * vx;
      const s = ((x - ax) * vy - (y - ay) * vx) / det;
      const t = (ux * (y - ay) - uy * (x - ax)) / det;
      if (!(s >= 0 && t >= 0 && s + t <= 1)) continue;
      const r = 1 - s - t;
      const depth = r * this.places[3 * i + 2] + s * this.places[3 * j + 2] + t * this.places[3 * k + 2];
      if (depth <= nearest) continue;
      nearest = depth;
      best = [
        r * points[2 * i] + s * points[2 * j] + t * points[2 * k],
        r * points[2 * i + 1] + s * points[2 * j + 1] + t * points[2 * k + 1],
      ];
    }
    return best;
  }
}

/** Out of the front at every node, of length 1. */
function normalsOf({ cells, nCells }: Topology, places: Float32Array): Float32Array {
  const out = new Float32Array(places.length);
  for (let c = 0; c < nCells; c++) {
    const [i, j, k] = [3 * cells[3 * c], 3 * cells[3 * c + 1], 3 * cells[3 * c + 2]];
    const [ux, uy, uz] = [places[j] - places[i], places[j + 1] - places[i + 1], places[j + 2] - places[i + 2]];
    const [vx, vy, vz] = [places[k] - places[i], places[k + 1] - places[i + 1], places[k + 2] - places[i + 2]];
    for (const at of [i, j, k]) {
      out[at] += uy * vz - uz * vy;
      out[at + 1] += uz * vx - ux * vz;
      out[at + 2] += ux * vy - uy * vx;
    }
  }
  for (let at = 0; at < out.length; at += 3) {
    const length = Math.hypot(out[at], out[at + 1], out[at + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) out[at + axis] /= length;
  }
  return out;
}

function middleOf(points: ArrayLike<number>): readonly number[] {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < points.length; k++) {
    low[k % 3] = Math.min(low[k % 3], points[k]);
    high[k % 3] = Math.max(high[k % 3], points[k]);
  }
  return low.map((value, k) => (value + high[k]) / 2);
}
