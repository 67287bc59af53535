/** Pointer, wheel and arrow keys on the sheet, turned into presses. */

import { signal } from "@preact/signals";
import { adjustForce, liftAll, press, release, slide } from "../presses";
import { hand, keepPresses, requestRepaint, scene } from "../state";
import { hovered, inSpace, turn } from "./space";
import { contains, toSheet, type View } from "./view";

/** Where the keyboard would press, m; null while the keyboard is elsewhere. */
export const cursor = signal<readonly [number, number] | null>(null);

/** No pointer has this number. */
const KEYBOARD = -1;
const STEP = 5e-3;
const FINE_STEP = 1e-3;
const WHEEL_STEP = 40;
/** Of the sheet's turn, per pixel. */
const RADIANS = 8e-3;

const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

function onSheet(x: number, y: number): boolean {
  return contains(scene.value?.outline ?? [], x, y);
}

/** Press with the probe's force and leave the press there; lift the one that is there. */
function keyPress([x, y]: readonly [number, number]): void {
  hand.value = release(press(hand.value, KEYBOARD, x, y, true), KEYBOARD);
}

function onArrow(event: KeyboardEvent): void {
  const arrow = ARROWS[event.key];
  const place = cursor.value ?? [0, 0];
  if (arrow) {
    const step = event.shiftKey ? FINE_STEP : STEP;
    const next = [place[0] + arrow[0] * step, place[1] + arrow[1] * step] as const;
    if (onSheet(...next)) cursor.value = next;
  } else if (event.key === "Enter") keyPress(place);
  else return;
  event.preventDefault();
  event.stopPropagation();
  requestRepaint();
}

/** A second tap so soon, s, and so near, px, is one gesture with the first. */
const TAP_S = 0.35;
const TAP_NEAR = 30;

/** Tells a finger's second tap: it keeps its press, or lifts a kept one, as Shift does for a mouse. */
class Taps {
  private last = { time: -Infinity, x: 0, y: 0 };

  isSecond(event: PointerEvent): boolean {
    if (event.pointerType !== "touch") return false;
    const { clientX: x, clientY: y } = event;
    const time = event.timeStamp / 1e3;
    const { last } = this;
    const second = time - last.time < TAP_S && Math.hypot(x - last.x, y - last.y) < TAP_NEAR;
    this.last = { time: second ? -Infinity : time, x, y };
    return second;
  }
}

/** Listen on an element that shows the sheet in the view of the moment. Returns the undoing. */
export function listen(element: HTMLElement, view: () => View): () => void {
  const quit = new AbortController();
  const { signal } = quit;
  let turned = 0;
  let turning: number | null = null;
  const taps = new Taps();

  const placeOf = (event: PointerEvent): readonly [number, number] => {
    const box = element.getBoundingClientRect();
    return toSheet(view(), event.clientX - box.left, event.clientY - box.top);
  };
  const pressable = () => scene.value?.pressable ?? false;

  element.addEventListener(
    "pointerdown",
    (event) => {
      const [x, y] = placeOf(event);
      if (inSpace.value && (event.button === 2 || !onSheet(x, y) || !pressable())) {
        turning = event.pointerId;
        element.setPointerCapture(event.pointerId);
        return;
      }
      if (event.button !== 0 || !pressable() || !onSheet(x, y)) return;
      element.setPointerCapture(event.pointerId);
      const keeping = taps.isSecond(event) || event.shiftKey || keepPresses.value;
      hand.value = press(hand.value, event.pointerId, x, y, keeping);
    },
    { signal },
  );
  element.addEventListener(
    "pointermove",
    (event) => {
      if (event.pointerId === turning) {
        turn(event.movementX * RADIANS, event.movementY * RADIANS);
        return;
      }
      const [x, y] = placeOf(event);
      hovered.value = onSheet(x, y) ? [x, y] : null;
      if (!element.hasPointerCapture(event.pointerId)) return;
      if (onSheet(x, y)) hand.value = slide(hand.value, event.pointerId, x, y);
    },
    { signal },
  );
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
    element.addEventListener(
      kind,
      (event) => {
        if (event.pointerId === turning) turning = null;
        hand.value = release(hand.value, event.pointerId);
      },
      { signal },
    );
  }
  element.addEventListener("pointerleave", () => (hovered.value = null), { signal });
  element.addEventListener("contextmenu", (event) => inSpace.value && event.preventDefault(), { signal });
  element.addEventListener(
    "wheel",
    (event) => {
      if (!pressable()) return;
      event.preventDefault();
      turned -= event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY * 16 : event.deltaY;
      const steps = Math.trunc(turned / WHEEL_STEP);
      turned -= steps * WHEEL_STEP;
      if (steps) hand.value = adjustForce(hand.value, steps);
    },
    { signal, passive: false },
  );
  element.addEventListener("keydown", (event) => pressable() && onArrow(event), { signal });
  element.addEventListener(
    "focus",
    () => {
      if (pressable() && element.matches(":focus-visible")) cursor.value ??= [0, 0];
      requestRepaint();
    },
    { signal },
  );
  element.addEventListener(
    "blur",
    () => {
      cursor.value = null;
      requestRepaint();
    },
    { signal },
  );
  // The window going away must not leave a press on the skin.
  window.addEventListener("blur", () => (hand.value = letGo()), { signal });
  return () => quit.abort();
}

function letGo() {
  const held = hand.value.held.filter((other) => other.pointer === null);
  return held.length ? { ...hand.value, held } : liftAll(hand.value);
}
