/** What the page of a robot is told: skins in space, how each is doing, and the touches on them. */

import { signal } from "@preact/signals";
import type { RobotScene, RobotState, RobotTouches } from "../wire";
import { FIRST_ORBIT, type Orbit, rotation } from "../sheet/solid";

export type SkinTouches = RobotTouches["skins"];

export const robot = signal<RobotScene | null>(null);
export const states = signal<RobotState | null>(null);
export const touches = signal<SkinTouches>({});
export const orbit = signal<Orbit>(FIRST_ORBIT);

/** From metres in the robot's root frame to pixels: right, down, and towards the eye. */
export interface Camera {
  readonly matrix: readonly number[];
  readonly middle: readonly [number, number, number];
  /** Half the robot's extent, m. */
  readonly radius: number;
  /** Pixels per metre. */
  readonly scale: number;
  readonly width: number;
  readonly height: number;
}

const MARGIN = 0.86;

/** A camera that sees all of ``points`` in a picture of so many pixels. */
export function cameraOf(points: readonly number[], view: Orbit, width: number, height: number): Camera {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < points.length; k++) {
    low[k % 3] = Math.min(low[k % 3], points[k]);
    high[k % 3] = Math.max(high[k % 3], points[k]);
  }
  const some = points.length > 0;
  const middle = low.map((value, k) => (some ? (value + high[k]) / 2 : 0)) as [number, number, number];
  const radius = some ? Math.max(1e-3, Math.hypot(...low.map((value, k) => (high[k] - value) / 2))) : 1;
  const scale = (MARGIN * Math.min(width, height)) / (2 * radius);
  return { matrix: rotation(view), middle, radius, scale, width, height };
}

/** A point in pixels; the third is metres towards the eye. */
export function toPicture(camera: Camera, x: number, y: number, z: number): [number, number, number] {
  const { matrix: m, middle, scale, width, height } = camera;
  const [a, b, c] = [x - middle[0], y - middle[1], z - middle[2]];
  const [right, up, near] = [0, 3, 6].map((row) => m[row] * a + m[row + 1] * b + m[row + 2] * c);
  return [width / 2 + scale * right, height / 2 - scale * up, near];
}

/** Whether a front that looks along ``normal`` is turned to the eye. */
export function isFacing(camera: Camera, [x, y, z]: readonly [number, number, number]): boolean {
  const { matrix: m } = camera;
  return m[6] * x + m[7] * y + m[8] * z > 0;
}
