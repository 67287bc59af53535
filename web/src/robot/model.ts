/** What the page of a robot is told: skins in space, how each is doing, and the touches on them. */

import { computed, signal } from "@preact/signals";
import type { RobotScene, RobotState, RobotTouches } from "../wire";
import { FIRST_ORBIT, type Orbit, rotation } from "../sheet/solid";

export type SkinTouches = RobotTouches["skins"];

export const robot = signal<RobotScene | null>(null);
export const states = signal<RobotState | null>(null);
export const touches = signal<SkinTouches>({});
/** Where the links are now, as in the scene; empty before the first message. */
export const poses = signal<readonly number[]>([]);
export const orbit = signal<Orbit>(FIRST_ORBIT);

/** All that is drawn, m in the root's frame; coordinates lie flat as x0, y0, z0, … */
export interface World {
  readonly bones: readonly number[];
  readonly links: readonly number[];
  /** Of each skin, in the order of the scene. */
  readonly skins: readonly (readonly number[])[];
}

/** Corners of link number ``link`` in the root's frame; on no link they stay. */
export function placed(corners: readonly number[], all: readonly number[], link: number | null): number[] {
  if (link === null) return [...corners];
  const m = all.slice(12 * link, 12 * link + 12);
  return corners.map((_, k) => {
    const [row, at] = [4 * (k % 3), k - (k % 3)];
    return m[row] * corners[at] + m[row + 1] * corners[at + 1] + m[row + 2] * corners[at + 2] + m[row + 3];
  });
}

export function worldOf(scene: RobotScene, all: readonly number[]): World {
  return {
    bones: scene.bones.flatMap((link) => placed([0, 0, 0], all, link)),
    links: scene.links.flatMap(({ link, corners }) => placed(corners, all, link)),
    skins: scene.skins.map(({ link, corners }) => placed(corners, all, link)),
  };
}

/** The robot as it stands now, and as it stood when it came: what the picture has room for. */
export const world = computed(() => robot.value && worldOf(robot.value, poses.value.length ? poses.value : robot.value.poses));
export const home = computed(() => robot.value && worldOf(robot.value, robot.value.poses));

/** Take the newest touches and where the links are; what moves not is not made again. */
export function follow(message: RobotTouches): void {
  touches.value = message.skins;
  const same = poses.value.length === message.poses.length && poses.value.every((x, k) => x === message.poses[k]);
  if (!same) poses.value = message.poses;
}

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
