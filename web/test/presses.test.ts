import { describe, expect, it } from "vitest";
import {
  adjustForce,
  emptyHand,
  grow,
  isGrowing,
  liftAll,
  MAX_PRESSES,
  press,
  release,
  slide,
  toMessage,
} from "../src/presses";

const hand = emptyHand({ radius: 0.01, force: 2, maxForce: 10 });

describe("a plain press", () => {
  it("follows its pointer and lifts with it", () => {
    const slid = slide(press(hand, 1, 0, 0, false), 1, 0.03, 0.01);
    expect(toMessage(slid)).toEqual([{ x: 0.03, y: 0.01, force: 2, radius: 0.01 }]);
    expect(toMessage(release(slid, 1))).toEqual([]);
    expect(release(slid, 2)).toEqual(slid);
  });

  it("gains force while held, up to the most", () => {
    let held = press(hand, 1, 0, 0, false);
    held = grow(held, 0.5);
    expect(held.held[0].force).toBeCloseTo(4.5);
    held = grow(held, 10);
    expect(held.held[0].force).toBe(10);
    expect(isGrowing(held)).toBe(false);
  });

  it("keeps the force that the wheel gave it", () => {
    const held = adjustForce(press(hand, 1, 0, 0, false), -2);
    expect(held.held[0].force).toBeCloseTo(1);
    expect(isGrowing(held)).toBe(false);
    expect(grow(held, 1).held[0].force).toBeCloseTo(1);
    expect(held.probe.force).toBe(2);
  });
});

describe("a kept press", () => {
  const kept = release(press(hand, 1, 0, 0, true), 1);

  it("stays, with its force, beside others", () => {
    expect(toMessage(kept)).toHaveLength(1);
    expect(isGrowing(kept)).toBe(false);
    const two = press(kept, 1, 0.05, 0, false);
    expect(toMessage(two)).toHaveLength(2);
    expect(toMessage(release(two, 1))).toEqual(toMessage(kept));
  });

  it("is taken up again by pressing on it, and lifted with keep", () => {
    const moved = release(slide(press(kept, 2, 0.004, 0, false), 2, 0.02, 0.02), 2);
    expect(toMessage(moved)).toEqual([{ x: 0.02, y: 0.02, force: 2, radius: 0.01 }]);
    expect(toMessage(press(kept, 2, 0.004, 0, true))).toEqual([]);
  });

  it("is lifted by lift all", () => {
    expect(liftAll(kept).held).toEqual([]);
    expect(liftAll(hand)).toBe(hand);
  });
});

it("sets the next press's force when nothing is held", () => {
  expect(adjustForce(hand, 3).probe.force).toBeCloseTo(3.5);
  expect(adjustForce(hand, 100).probe.force).toBe(10);
  expect(adjustForce(hand, -100).probe.force).toBeCloseTo(0.5);
});

it("never holds more presses than the server takes", () => {
  let many = hand;
  for (let k = 0; k < MAX_PRESSES + 3; k++) many = press(many, k, 0.05 * k, 0, true);
  expect(toMessage(many)).toHaveLength(MAX_PRESSES);
});
