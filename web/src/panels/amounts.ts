/** What calibrations tell of touches, and which of it their strength is shown as. */

import { computed, effect, signal } from "@preact/signals";
import type { Measurand } from "../decode";
import { calibrations } from "../flows/model";
import { niceAbove } from "../format";
import { shown } from "../state";
import { MEASURANDS } from "../words";

const NAMES = ["force", "depth"] as const;

/** Those that the touches seen last have. */
const known = signal<readonly Measurand[]>([]);

effect(() => {
  const touches = shown.value?.touches ?? [];
  if (touches.length) known.value = NAMES.filter((name) => touches.some((touch) => touch[name]));
});

type Kind = Measurand | "change";
const chosen = signal<Kind>("force");

/** All that strengths can be shown as now, the change of conductivity last. */
const offered = computed<readonly Kind[]>(() => [...known.value, "change"]);
export const several = computed(() => offered.value.length > 1);

/** What they are shown as; never one that is not known. */
export const shownAs = computed<Kind>(() => (offered.value.includes(chosen.value) ? chosen.value : offered.value[0]));

const following = computed<Kind>(() => {
  const all = offered.value;
  return all[(all.indexOf(shownAs.value) + 1) % all.length];
});

/** Show the next of them. */
export function showNext(): void {
  chosen.value = following.value;
}

export const next = computed(() => `Show ${following.value === "change" ? "the change of conductivity" : following.value}`);

/** The end of the ordinate, SI: it follows the calibration, and moves for nothing else. */
export const most = computed(() => {
  const name = shownAs.value;
  return name === "change" ? 0 : niceAbove(calibrations.value.most[name] ?? MEASURANDS[name].usual);
});
