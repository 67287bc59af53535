/** Strength, force, depth and way of each touch over the last seconds: a few fixed slots, one touch in each. */

import type { Measurand, Touch } from "./decode";

type Column = (number | null)[];

export const SPAN = 10;
export const SLOTS = 8;

/** Seconds of a touch's way that are shown on the sheet. */
const TRAIL = 2;

interface Slot {
  id: number | null;
  seen: number;
}

const emptyColumns = (): Column[] => Array.from({ length: SLOTS }, () => []);
const emptyAmounts = () => ({ values: emptyColumns(), lows: emptyColumns(), highs: emptyColumns() });

export class History {
  readonly times: number[] = [];
  readonly columns = emptyColumns();
  /** x and y of each slot's touch, m. */
  readonly xs = emptyColumns();
  readonly ys = emptyColumns();
  /** What calibrations tell of it, and the ends of the intervals, SI. */
  readonly amounts = { force: emptyAmounts(), depth: emptyAmounts() };
  private readonly slots: Slot[] = Array.from({ length: SLOTS }, () => ({ id: null, seen: 0 }));

  /** Add one frame's touches at a time in seconds; time running backwards starts afresh. */
  add(time: number, touches: readonly Touch[]): void {
    const last = this.times[this.times.length - 1];
    if (last !== undefined && time < last) this.clear();
    this.times.push(time);
    for (const column of this.all()) column.push(null);
    for (const touch of touches) {
      const slot = this.slotOf(touch.id, time);
      if (slot < 0) continue;
      this.slots[slot].seen = time;
      const at = this.times.length - 1;
      this.columns[slot][at] = Math.abs(touch.peak);
      this.xs[slot][at] = touch.x;
      this.ys[slot][at] = touch.y;
      for (const [name, { values, lows, highs }] of Object.entries(this.amounts)) {
        const amount = touch[name as Measurand];
        values[slot][at] = amount?.value ?? null;
        lows[slot][at] = amount?.low ?? null;
        highs[slot][at] = amount?.high ?? null;
      }
    }
  }

  /** The touch last drawn in a slot. */
  idOf(slot: number): number | null {
    return this.slots[slot].id;
  }

  /** Where a touch was of late, oldest first, m. */
  trailOf(id: number): (readonly [number, number])[] {
    const slot = this.slots.findIndex((each) => each.id === id);
    const trail: (readonly [number, number])[] = [];
    if (slot < 0) return trail;
    const last = this.times.length - 1;
    for (let k = last; k >= 0 && this.times[k] > this.times[last] - TRAIL; k--) {
      const [x, y] = [this.xs[slot][k], this.ys[slot][k]];
      if (x == null || y == null) break;
      trail.push([x, y]);
    }
    return trail.reverse();
  }

  private all(): Column[] {
    const amounts = Object.values(this.amounts).flatMap(({ values, lows, highs }) => [values, lows, highs]);
    return [this.columns, this.xs, this.ys, ...amounts].flat();
  }

  /** Drop what is older than the span; call now and then, not per frame. */
  trim(): void {
    const now = this.times[this.times.length - 1] ?? 0;
    let old = 0;
    while (old < this.times.length && this.times[old] < now - SPAN) old++;
    if (old === 0) return;
    this.times.splice(0, old);
    for (const column of this.all()) column.splice(0, old);
  }

  clear(): void {
    this.times.length = 0;
    for (const column of this.all()) column.length = 0;
    for (const slot of this.slots) slot.id = null;
  }

  private slotOf(id: number, time: number): number {
    const mine = this.slots.findIndex((slot) => slot.id === id);
    if (mine >= 0) return mine;
    const free = this.slots.findIndex((slot) => slot.id === null || slot.seen < time - SPAN);
    if (free >= 0) this.slots[free].id = id;
    return free;
  }
}
