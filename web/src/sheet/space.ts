/** Whether the sheet is shown in space, from where, and what the pointer is over. */

import { computed, signal } from "@preact/signals";
import { addCommand } from "../commands";
import { scene, topology } from "../state";
import { Locator } from "./locate";
import { FIRST_ORBIT, type Orbit, rotation, Seen } from "./solid";

/** Null: as the skin is, in space where it lies on a surface. */
const chosen = signal<boolean | null>(null);
export const inSpace = computed(() => chosen.value ?? scene.value?.solid != null);
export const showInSpace = (): void => void (chosen.value = true);
export const orbit = signal<Orbit>(FIRST_ORBIT);

export const locator = computed(() => (topology.value ? new Locator(topology.value) : null));

/** The points in space; of a flat sheet, with nothing above it. */
const solid = computed(() => {
  const { points, solid } = scene.value ?? { points: [], solid: null };
  if (solid) return solid;
  const flat = new Float32Array((points.length / 2) * 3);
  for (let k = 0; k < points.length / 2; k++) flat.set([points[2 * k], points[2 * k + 1], 0], 3 * k);
  return flat;
});

export const seen = computed(() => {
  if (!inSpace.value || !topology.value || !locator.value) return null;
  return Seen.of(topology.value, locator.value, solid.value, rotation(orbit.value));
});

/** Where the pointer is on the sheet, m. */
export const hovered = signal<readonly [number, number] | null>(null);

/** Source and sink that are looked at; null: none. */
export const shownDrive = signal<readonly [number, number] | null>(null);
/** Plus and minus of the measurement that is looked at. */
export const shownPair = signal<readonly [number, number] | null>(null);

const LOWEST = 0.02;
const HIGHEST = 1.55;

/** Turn by so many radians. */
export function turn(right: number, up: number): void {
  const { turn, tilt } = orbit.peek();
  orbit.value = { turn: turn + right, tilt: Math.min(HIGHEST, Math.max(LOWEST, tilt + up)) };
}

export const space = {
  id: "space",
  label: "3D",
  key: "D",
  code: "d",
  title: "Show the sheet in space, or flat; drag beside it, or with the right button, to turn it",
  run: () => void (chosen.value = !inSpace.peek()),
};
addCommand(space);

const TURN = 0.15;
for (const [id, key, label, right, up] of [
  ["turn-left", ",", "Turn left", -TURN, 0],
  ["turn-right", ".", "Turn right", TURN, 0],
  ["tilt-up", "<", "Tilt away", 0, -TURN],
  ["tilt-down", ">", "Tilt towards", 0, TURN],
] as const) {
  addCommand({ id, label, key, code: key, title: label, run: () => turn(right, up) });
}
