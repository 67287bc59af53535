/** The dent of touches as the relief of the sheet in space: off, higher than it is, or true to scale. */

import { computed, effect, signal } from "@preact/signals";
import { addCommand } from "../commands";
import type { Frame } from "../decode";
import { calibrations } from "../flows/model";
import { fixed } from "../format";
import { narrow } from "../screen";
import { link, onMessage, scene, send, shown, topology } from "../state";
import { DENT_STEP } from "../wire";
import type { Found } from "./locate";
import { inSpace, orbit, showInSpace } from "./space";
import { barLength, boxOf, type View } from "./view";

const FACTORS = [50, 20, 10, 5, 2];
/** Part of the sheet's breadth that the deepest press that was taught is drawn deep. */
const DEEPEST = 0.12;
const BARS = [50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1];

/** How heights are drawn. */
export const heights = signal<"off" | "raised" | "true">("off");
/** Why the server sends no dents; "" where it does. */
const problem = signal("");
onMessage("dent", (message) => (problem.value = message.problem));

/** By how much heights are drawn larger: it follows from the calibration, and no touch changes it. */
const factor = computed(() => {
  const box = boxOf(scene.value?.outline ?? [0, 0]);
  const room = DEEPEST * Math.max(box.right - box.left, box.top - box.bottom);
  const most = calibrations.value.most.depth;
  return most ? (FACTORS.find((times) => times * most <= room) ?? 1) : 1;
});
const times = computed(() => (heights.value === "raised" ? factor.value : 1));
const wanted = computed(() => heights.value !== "off" && inSpace.value);

let asked = false;
effect(() => {
  void [calibrations.value, scene.value];
  if (link.value.phase !== "open") asked = false;
  else if (wanted.value || asked) send({ type: "dent", on: (asked = wanted.value) });
});

export const relief = {
  id: "relief",
  label: "Relief",
  key: "Z",
  code: "z",
  title: "Show the dents of touches in space: raised, then true to scale, then off",
  run(): void {
    const was = wanted.peek() ? heights.peek() : "off";
    if (was === "off") showInSpace();
    heights.value = was === "off" ? (factor.peek() > 1 ? "raised" : "true") : was === "raised" ? "true" : "off";
  },
};
addCommand(relief);

/** The view with the dents of a frame, where they are shown. */
export function dented(view: View, frame: Frame | null): View {
  if (!view.seen || !frame?.dent || !wanted.peek() || 3 * frame.dent.deflection.length !== view.seen.places.length) return view;
  return { ...view, seen: view.seen.dented(frame.dent.deflection, DENT_STEP * times.peek()) };
}

/** How far the sheet has given way at a place, in words. */
export function depthAt(frame: Frame, { cell, weights }: Found) {
  const cells = topology.value?.cells;
  if (!cells || !frame.dent || !wanted.value) return null;
  const mean = (counts: Uint16Array) =>
    1e3 * DENT_STEP * weights.reduce((sum, weight, k) => sum + weight * counts[cells[3 * cell + k]], 0);
  return (
    <span data-testid="deep">
      , {fixed(mean(frame.dent.deflection), 2)} ± {fixed(mean(frame.dent.deviation), 2)} mm deep
    </span>
  );
}

/** Two bars true to scale, along the screen and into the sheet; or why there is no relief. */
export function Relief({ view }: { view: View }) {
  if (!wanted.value || !scene.value) return null;
  const touches = shown.value?.touches.length ?? 0;
  const why = problem.value || (touches > 0 && !shown.value?.dent ? "the depth of a touch is uncalibrated" : "");
  if (why) {
    return (
      <p class="relief wrong" role="status" data-testid="relief">
        No relief: {why}.
      </p>
    );
  }
  const along = barLength(boxOf(scene.value.outline));
  const across = along * view.scale;
  const perMm = 1e-3 * times.value * view.scale * Math.sin(orbit.value.tilt);
  const deep = BARS.find((mm) => mm * perMm <= 70) ?? BARS[BARS.length - 1];
  const [x, y] = narrow.value ? [10, view.height - 10] : [24, view.height - 26];
  const said = times.value > 1 ? `${deep} mm deep, drawn ×${times.value}` : `${deep} mm deep, true to scale`;
  return (
    <svg class="furniture relief" width={view.width} height={view.height} role="img" aria-label={said} data-testid="relief">
      <g class="bar">
        <path d={`M${x + 5} ${y - deep * perMm}H${x}V${y}H${x + across}V${y - 5}`} />
        <text class="start" x={x + 10} y={y - Math.max(30, deep * perMm)}>
          {said}
        </text>
        <text x={x + across / 2} y={y - 12}>
          {along >= 0.01 ? `${along * 100} cm` : `${along * 1000} mm`}
        </text>
      </g>
    </svg>
  );
}
