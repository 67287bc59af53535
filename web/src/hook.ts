/** `window.tomoskin`: what tests and benches read of the page. Nothing here changes anything. */

import type { Frame } from "./decode";
import { first } from "./latency";
import { sheetElement, view } from "./sheet/Sheet";
import { toPixels, toSheet } from "./sheet/view";
import { cost, newest, scene } from "./state";
import type { Scene } from "./wire";

export interface Hook {
  /** Frames received. */
  readonly frames: number;
  readonly last: Frame | null;
  readonly scene: Scene | null;
  /** When the first picture was drawn, ms from the navigation. */
  readonly ready: number | null;
  /** Scripting time spent on frames so far, s. */
  readonly scripting: number;
  /** Metres on the sheet to client pixels. */
  sheetToClient(x: number, y: number): { x: number; y: number };
  clientToSheet(cx: number, cy: number): { x: number; y: number };
}

declare global {
  interface Window {
    readonly tomoskin: Hook;
  }
}

function corner(): readonly [number, number] {
  const box = sheetElement()?.getBoundingClientRect();
  return [box?.left ?? 0, box?.top ?? 0];
}

export function installHook(): void {
  const hook: Hook = {
    get frames() {
      return newest.count;
    },
    get last() {
      return newest.frame;
    },
    get scene() {
      return scene.peek();
    },
    get ready() {
      return first.at;
    },
    get scripting() {
      return cost.seconds;
    },
    sheetToClient(x, y) {
      const [left, top] = corner();
      const [px, py] = toPixels(view.peek(), x, y);
      return { x: left + px, y: top + py };
    },
    clientToSheet(cx, cy) {
      const [left, top] = corner();
      const [x, y] = toSheet(view.peek(), cx - left, cy - top);
      return { x, y };
    },
  };
  Object.defineProperty(window, "tomoskin", { value: Object.freeze(hook) });
}
