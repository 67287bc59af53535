/** What opens below the touches, never over the sheet: one at a time, each registered once. */

import { computed, effect, signal } from "@preact/signals";
import type { ComponentType } from "preact";

export interface Drawer {
  readonly id: string;
  readonly label: string;
  /** As on the keycap; a lower-case letter of the keyboard. */
  readonly key: string;
  readonly title: string;
  /** Reads signals; without it the drawer is always offered. */
  readonly offered?: () => boolean;
  readonly View: ComponentType;
}

const registered = signal<readonly Drawer[]>([]);
const wanted = signal<string | null>(null);

export const drawers = computed(() => registered.value.filter(({ offered }) => offered?.() ?? true));

/** The open drawer, or null. */
export const opened = computed(() => drawers.value.find(({ id }) => id === wanted.value) ?? null);

/** Offer a drawer; they stand in the order in which they were added. */
export function addDrawer(drawer: Drawer): void {
  registered.value = [...registered.value.filter(({ id }) => id !== drawer.id), drawer];
}

/** Open a drawer, or close it where it is open. */
export function toggleDrawer(id: string): void {
  wanted.value = wanted.peek() === id ? null : id;
}

export const closeDrawer = (): void => void (wanted.value = null);

/** Call back whenever a drawer opens, and every so many ms while it is open (null: not again), as to
 * ask the server for what it shows. */
export function whileOpened(id: string, every: number | null, callback: () => void): void {
  const open = computed(() => opened.value?.id === id);
  effect(() => {
    if (!open.value) return;
    callback();
    const timer = every === null ? 0 : window.setInterval(callback, every);
    return () => window.clearInterval(timer);
  });
}
