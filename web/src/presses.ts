/** The presses that this page holds on the twin, as a pure state machine in metres and newtons. */

import { CIRCLE, type Face, faceMessage } from "./faces";
import type { PressRequest } from "./wire";

export const MAX_PRESSES = 8;

export interface Sizes {
  /** Half of the face's size, m. */
  readonly radius: number;
  /** Force at the first contact, N. */
  readonly force: number;
  readonly maxForce: number;
}

export interface Probe extends Sizes {
  readonly face: Face;
  /** By which the face is turned, rad. */
  readonly angle: number;
  /** Whether the force grows while a press is held; a weight's does not. */
  readonly grows: boolean;
}

export interface Held {
  readonly x: number;
  readonly y: number;
  /** N. */
  readonly force: number;
  readonly radius: number;
  readonly face: Face;
  readonly angle: number;
  /** The pointer that holds it, or null: it stays by itself. */
  readonly pointer: number | null;
  /** Stays when the pointer lets go. */
  readonly kept: boolean;
  /** Force still grows while it is held. */
  readonly growing: boolean;
}

export interface Hand {
  readonly probe: Probe;
  readonly held: readonly Held[];
}

/** Seconds from nothing to full force while a press is held. */
const FULL_FORCE_AFTER = 2;
/** Steps of the wheel (or of the buttons) from nothing to full force. */
const FORCE_STEPS = 20;

export const emptyHand = (sizes: Sizes): Hand => ({
  probe: { face: CIRCLE, angle: 0, grows: true, ...sizes },
  held: [],
});

const changed = (hand: Hand, change: (press: Held) => Held): Hand => ({
  ...hand,
  held: hand.held.map(change),
});

/** The kept press under a point, if any. */
export function keptAt(hand: Hand, x: number, y: number): Held | undefined {
  return hand.held.find(
    (press) => press.pointer === null && Math.hypot(press.x - x, press.y - y) <= press.radius,
  );
}

/** A pointer comes down: takes hold of a kept press (or lifts it, with `keep`), else presses. */
export function press(hand: Hand, pointer: number, x: number, y: number, keep: boolean): Hand {
  const under = keptAt(hand, x, y);
  if (under && keep) return lifted(hand, under);
  if (under) return changed(hand, (other) => (other === under ? { ...other, pointer } : other));
  if (hand.held.length >= MAX_PRESSES) return hand;
  const { force, radius, face, angle, grows } = hand.probe;
  const fresh: Held = { x, y, force, radius, face, angle, pointer, kept: keep, growing: grows };
  return { ...hand, held: [...hand.held, fresh] };
}

/** A pointer slides. */
export function slide(hand: Hand, pointer: number, x: number, y: number): Hand {
  return changed(hand, (held) => (held.pointer === pointer ? { ...held, x, y } : held));
}

/** A pointer lets go: its press lifts unless it is kept. */
export function release(hand: Hand, pointer: number): Hand {
  return {
    ...hand,
    held: hand.held
      .filter((held) => held.pointer !== pointer || held.kept)
      .map((held) =>
        held.pointer === pointer ? { ...held, pointer: null, growing: false } : held,
      ),
  };
}

const stepped = (force: number, steps: number, most: number): number => {
  const step = most / FORCE_STEPS;
  return Math.min(most, Math.max(step, (Math.round(force / step) + steps) * step));
};

/** Wheel or buttons: sets the force of what is held now (which stops growing), else of the probe. */
export function adjustForce(hand: Hand, steps: number): Hand {
  const { maxForce } = hand.probe;
  if (hand.held.some((held) => held.pointer !== null)) {
    return changed(hand, (held) =>
      held.pointer === null
        ? held
        : { ...held, growing: false, force: stepped(held.force, steps, maxForce) },
    );
  }
  return { ...hand, probe: { ...hand.probe, force: stepped(hand.probe.force, steps, maxForce) } };
}

/** Whether time alone changes something. */
export function isGrowing(hand: Hand): boolean {
  return hand.held.some((held) => held.growing && held.force < hand.probe.maxForce);
}

/** Time passes: held presses gain force up to the most. */
export function grow(hand: Hand, seconds: number): Hand {
  const { maxForce } = hand.probe;
  const gain = (maxForce * seconds) / FULL_FORCE_AFTER;
  return changed(hand, (held) =>
    held.growing ? { ...held, force: Math.min(maxForce, held.force + gain) } : held,
  );
}

export const liftAll = (hand: Hand): Hand => (hand.held.length ? { ...hand, held: [] } : hand);

/** Lift one of the presses. */
export const lifted = (hand: Hand, which: Held): Hand => ({
  ...hand,
  held: hand.held.filter((press) => press !== which),
});

/** One step more or less of the force of one press. */
export function reforced(hand: Hand, which: Held, steps: number): Hand {
  const force = stepped(which.force, steps, hand.probe.maxForce);
  return changed(hand, (press) => (press === which ? { ...press, force, growing: false } : press));
}

/** What the server is told. */
export function toMessage(hand: Hand): PressRequest[] {
  return hand.held.map(({ x, y, force, radius, face, angle }) => ({
    ...{ x, y, force, radius },
    ...faceMessage(face, radius, angle),
  }));
}
