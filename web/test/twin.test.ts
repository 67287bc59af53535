import { describe, expect, it } from "vitest";
import { CIRCLE, FACES, rim, faceMessage } from "../src/faces";
import { emptyHand, lifted, press, reforced, release, toMessage } from "../src/presses";
import { profile } from "../src/twin/BendFigure";

const face = (id: string) => FACES.find((one) => one.id === id) ?? CIRCLE;
const hand = emptyHand({ radius: 0.01, force: 2, maxForce: 10 });

describe("a probe's face", () => {
  it("is faceMessage by its shape, turn and corners, a circle by nothing", () => {
    expect(faceMessage(CIRCLE, 0.01, 1)).toEqual({});
    expect(faceMessage(face("square"), 0.01, 1)).toEqual({ shape: "square", angle: 1 });
    const bar = faceMessage(face("bar"), 0.02, 0);
    expect(bar).toMatchObject({ shape: "polygon", vertices: [[0.02, 0.005], [-0.02, 0.005], [-0.02, -0.005], [0.02, -0.005]] });
  });

  it("goes with the press that is made with it", () => {
    const turned = { ...hand, probe: { ...hand.probe, face: face("finger"), angle: 0.5 } };
    expect(toMessage(press(turned, 1, 0, 0, false))).toEqual([
      { x: 0, y: 0, force: 2, radius: 0.01, shape: "finger", angle: 0.5 },
    ]);
  });

  it.each(FACES)("$id looks as wide as it is", (one) => {
    const reach = Math.max(...rim(one, 0.01, 0).map(([x, y]) => Math.hypot(x, y)));
    expect(reach).toBeGreaterThanOrEqual(0.01 * 0.99);
    expect(reach).toBeLessThan(0.0142);
    const [[x, y]] = rim(one, 0.01, 0);
    const [[u, v]] = rim(one, 0.01, Math.PI / 2);
    expect(u).toBeCloseTo(-y);
    expect(v).toBeCloseTo(x);
  });
});

it("one of several presses is changed and lifted", () => {
  let two = release(press(hand, 1, 0, 0, true), 1);
  two = release(press(two, 1, 0.05, 0, true), 1);
  const harder = reforced(two, two.held[1], 2);
  expect(harder.held.map(({ force }) => force)).toEqual([2, 3]);
  expect(lifted(harder, harder.held[0]).held.map(({ x }) => x)).toEqual([0.05]);
});

describe("the drawing of a bend", () => {
  const ends = (angle: number) => {
    const points = profile(angle);
    return [points[0], points[points.length - 1]];
  };

  it("is straight where the sheet is, and its ends go down where the front is convex", () => {
    expect(profile(0).every(([, y]) => Math.abs(y) < 1e-9)).toBe(true);
    for (const [, y] of ends(1)) expect(y).toBeLessThan(-5);
    for (const [, y] of ends(-1)) expect(y).toBeGreaterThan(5);
  });

  it("stays within its frame", () => {
    for (const angle of [-Math.PI / 2, 0, 1, 2.6]) {
      for (const [x] of profile(angle)) expect(Math.abs(x)).toBeLessThan(43);
    }
  });
});
