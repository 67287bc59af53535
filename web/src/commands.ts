/** What a person can ask for, each with its key and its words: buttons and keyboard share them. */

import { computed, signal } from "@preact/signals";
import { closeDrawer, drawers, toggleDrawer } from "./drawers";
import { niceAbove } from "./format";
import { adjustForce, liftAll } from "./presses";
import * as state from "./state";

export interface Command {
  readonly id: string;
  readonly label: string;
  /** As on the keycap; `code` is what the keyboard sends. */
  readonly key: string;
  readonly code: string;
  readonly title: string;
  run(): void;
}

/** The limit that shows all of the present image: a round number above its largest change. */
function autoLimit(): number | null {
  const image = state.newest.frame?.image;
  if (!image) return null;
  let largest = 0;
  for (const value of image) largest = Math.max(largest, Math.abs(value));
  return largest > 0 ? niceAbove(largest) : null;
}

export const takeReference: Command = {
  id: "reference",
  label: "Reference",
  key: "R",
  code: "r",
  title: "Take the skin as it is now as untouched",
  run: () => state.send({ type: "reference" }),
};

export const pause: Command = {
  id: "pause",
  label: "Pause",
  key: "Space",
  code: " ",
  title: "Hold the image; again to go on",
  run: () => {
    const { replay, paused = false } = state.status.value ?? {};
    state.send(replay?.ended ? { type: "seek", at_s: 0 } : { type: "pause", on: !paused });
  },
};

export const record: Command = {
  id: "record",
  label: "Record",
  key: "C",
  code: "c",
  title: "Record to a file where tomoskin runs; again to stop",
  run: () => state.send({ type: "record", on: !state.status.value?.recording }),
};

export const lift: Command = {
  id: "lift",
  label: "Lift all",
  key: "Esc",
  code: "Escape",
  title: "Lift every press; where there is none, close the drawer",
  run: () => {
    if (state.hand.peek().held.length === 0) closeDrawer();
    state.hand.value = liftAll(state.hand.peek());
  },
};

export const keep: Command = {
  id: "keep",
  label: "Keep presses",
  key: "Shift",
  code: "k",
  title: "Presses stay when released (or hold Shift, or key K)",
  run: () => (state.keepPresses.value = !state.keepPresses.value),
};

export const softer: Command = {
  id: "softer",
  label: "−",
  key: "−",
  code: "-",
  title: "Less force (wheel down)",
  run: () => (state.hand.value = adjustForce(state.hand.value, -1)),
};

export const harder: Command = {
  id: "harder",
  label: "+",
  key: "+",
  code: "+",
  title: "More force (wheel up)",
  run: () => (state.hand.value = adjustForce(state.hand.value, 1)),
};

export const flat: Command = {
  id: "flat",
  label: "Cells",
  key: "F",
  code: "f",
  title: "Show the triangles of the mesh without smoothing",
  run: () => (state.smoothed.value = !state.smoothed.value),
};

export const truth: Command = {
  id: "truth",
  label: "Truth",
  key: "T",
  code: "t",
  title: "Show where the simulated skin is really pressed, as dashed rings",
  run: () => (state.showTruth.value = !state.showTruth.value),
};

export const fitColours: Command = {
  id: "auto",
  label: "Fit colours",
  key: "A",
  code: "a",
  title: "Fit the colour limits to the present image, once",
  run: () => (state.ownLimit.value = autoLimit() ?? state.ownLimit.value),
};

const more = signal<readonly Command[]>([]);

/** Offer a command by its key beside those of the page itself. */
export function addCommand(command: Command): void {
  more.value = [...more.value.filter(({ id }) => id !== command.id), command];
}

const drawerCommands = computed(() =>
  drawers.value.map(({ id, label, key, title }) => ({
    id,
    label,
    key,
    title,
    code: key.toLowerCase(),
    run: () => toggleDrawer(id),
  })),
);

/** The ones that a press needs are there only where the source can be pressed. */
export const available = computed<readonly Command[]>(() => [
  takeReference,
  pause,
  record,
  ...(state.scene.value?.pressable ? [lift, keep, softer, harder] : []),
  ...(state.scene.value?.truth ? [truth] : []),
  flat,
  fitColours,
  ...more.value,
  ...drawerCommands.value,
]);

/** After a click a button does not keep the focus, so that Space still means pause. */
export function onClick(event: MouseEvent): void {
  const button = event.target instanceof Element ? event.target.closest("button") : null;
  if (event.detail > 0) button?.blur();
}

/** Run the command of a key; typing and pressing buttons keep their own meaning. */
export function onKey(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const target = event.target instanceof HTMLElement ? event.target : null;
  if (target?.matches("input, select, textarea")) return;
  if (event.key === " " && target?.matches("button, summary")) return;
  const key = event.key === "=" ? "+" : event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const command = available.value.find(({ code }) => code === key);
  if (!command || (event.repeat && command !== softer && command !== harder)) return;
  event.preventDefault();
  command.run();
}
