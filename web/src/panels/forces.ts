/** Whether touches have forces, and in what their strength is shown. */

import { computed, effect, signal } from "@preact/signals";
import { type ForceState, forceStateOf } from "../decode";
import { calibrations } from "../flows/model";
import { niceAbove } from "../format";
import { shown } from "../state";

/** Of the touches that were seen last. */
export const forceState = signal<ForceState>("none");

/** Whether the change of conductivity is shown where forces are known too. */
export const asChange = signal(false);
export const inNewtons = computed(() => forceState.value !== "none" && !asChange.value);

effect(() => {
  const touches = shown.value?.touches ?? [];
  if (touches.length) forceState.value = forceStateOf(touches);
});

/** What the ordinate ends with, N, where the calibration does not say what it reaches. */
const USUAL = 10;

/** The end of the ordinate in newtons: it follows the calibration, and moves for nothing else. */
export const mostNewtons = computed(() => niceAbove(calibrations.value.force_most_n ?? USUAL));
