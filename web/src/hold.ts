/** Keeps the server told of the hand: at most once a displayed frame, growing while held. */

import { effect } from "@preact/signals";
import { grow, isGrowing, toMessage } from "./presses";
import { hand, link, onMessage, requestRepaint, scene, send } from "./state";

let said = "[]";
let waiting = false;
let last = 0;

function step(time: number): void {
  waiting = false;
  // A first step has no previous one to count from.
  const seconds = last ? Math.min(0.1, (time - last) / 1e3) : 0;
  const growing = isGrowing(hand.peek());
  last = growing ? time : 0;
  const presses = toMessage(hand.peek());
  const text = JSON.stringify(presses);
  if (text !== said && link.peek().phase === "open") {
    said = text;
    send({ type: "presses", presses });
  }
  requestRepaint();
  if (!growing) return;
  hand.value = grow(hand.peek(), seconds);
  plan();
}

function plan(): void {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(step);
}

// A twin that was made anew is pressed by nobody: what the hand holds is said again.
onMessage("scene", () => {
  said = "[]";
  plan();
});

/** Start telling; call once. */
export function startHolding(): void {
  effect(() => {
    if (link.value.phase !== "open") said = "[]";
    else if (hand.value && scene.value?.pressable) plan();
  });
}
