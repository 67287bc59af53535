/** What is done to the twin beside pressing it, as the server tells it, and how it is asked for. */

import { signal } from "@preact/signals";
import { soon } from "../settings/model";
import { onMessage, send } from "../state";
import type { TwinBend, TwinState, TwinStretch } from "../wire";

const UNKNOWN: TwinState = {
  type: "twin",
  breakable: false,
  cut: [],
  noise: null,
  bendable: false,
  bends: null,
  bend: null,
  stretch: null,
  size_m: 0.2,
};

export const twin = signal<TwinState>(UNKNOWN);

export interface Wanted {
  readonly bend: TwinBend;
  readonly stretch: TwinStretch;
}

const LEVEL: TwinStretch = { along: 0, across: 0, axis: 0 };

const flat = (size: number): Wanted => ({
  bend: { angle: 0, axis: Math.PI / 2, length: Math.min(0.06, size), offset: 0 },
  stretch: LEVEL,
});

/** The sliders: what the twin is, or is being asked for. */
export const wanted = signal<Wanted>(flat(UNKNOWN.size_m));
/** Why the last bend was refused, in words. */
export const refusal = signal<string | null>(null);
/** Requests that have not been answered yet, and whether another is due: an older answer must not
 * move a slider back. */
let unanswered = 0;
let due = false;

// What was asked of another source, or before the connection was lost, is not answered any more.
onMessage("scene", () => {
  unanswered = 0;
  due = false;
});
onMessage("twin", (message) => {
  twin.value = message;
  unanswered = Math.max(0, unanswered - 1);
  if (unanswered > 0 || due) return;
  const { bend, stretch } = flat(message.size_m);
  wanted.value = {
    bend: message.bend ?? { ...bend, axis: wanted.value.bend.axis, length: wanted.value.bend.length },
    stretch: message.stretch ?? { ...stretch, axis: wanted.value.stretch.axis },
  };
});
onMessage("twin_refused", ({ message }) => (refusal.value = message));

/** Break and mend. */
export function harm(change: Partial<Pick<TwinState, "cut" | "noise">>): void {
  const { cut, noise } = twin.value;
  send({ type: "twin", cut, noise, ...change });
}

/** Move sliders; the twin follows, no faster than it can. */
export function want(part: Partial<Wanted>): void {
  wanted.value = { ...wanted.value, ...part };
  due = true;
  soon(pose);
}

/** Bend and stretch as the sliders stand. */
function pose(): void {
  const { bend, stretch } = wanted.peek();
  refusal.value = null;
  due = false;
  unanswered++;
  send({
    type: "pose",
    bend: bend.angle === 0 ? null : bend,
    stretch: stretch.along === 0 && stretch.across === 0 ? null : stretch,
  });
}

export function layFlat(): void {
  const { bend, stretch } = wanted.peek();
  want({ bend: { ...bend, angle: 0 }, stretch: { ...LEVEL, axis: stretch.axis } });
}
