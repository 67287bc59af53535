/** The page of a robot: from metres to pixels, whichever way it is turned. */

import { describe, expect, it } from "vitest";
import { cameraOf, follow, home, isFacing, robot, toPicture, world, worldOf } from "../src/robot/model";
import { touchLines } from "../src/robot/Skins";
import { parts } from "../src/robot/solids";

const ENDS = [-1, -1, -1, 1, 1, 1];

describe("a camera", () => {
  it("sees all of a robot from everywhere", () => {
    for (const turn of [0, 1, 2, 3, 4, 5, 6]) {
      for (const tilt of [0.05, 0.9, 1.6, 3.0]) {
        const camera = cameraOf(ENDS, { turn, tilt }, 300, 200);
        for (let corner = 0; corner < 8; corner++) {
          const [x, y, z] = [1, 2, 4].map((bit) => (corner & bit ? 1 : -1));
          const [px, py] = toPicture(camera, x, y, z);
          expect(px).toBeGreaterThan(0);
          expect(px).toBeLessThan(300);
          expect(py).toBeGreaterThan(0);
          expect(py).toBeLessThan(200);
        }
      }
    }
  });

  it("looks down on what faces up, and has its middle in the middle", () => {
    const camera = cameraOf(ENDS, { turn: 0.3, tilt: 0.2 }, 300, 200);
    expect(isFacing(camera, [0, 0, 1])).toBe(true);
    expect(isFacing(camera, [0, 0, -1])).toBe(false);
    expect(toPicture(camera, 0, 0, 0)).toEqual([150, 100, 0]);
  });

  it("keeps lengths across the line of sight", () => {
    const camera = cameraOf(ENDS, { turn: 0, tilt: 0 }, 300, 200);
    const [ax] = toPicture(camera, 0, 0, 0);
    const [bx] = toPicture(camera, 0.5, 0, 0);
    expect(bx - ax).toBeCloseTo(0.5 * camera.scale);
  });

  it("does without any skin", () => {
    expect(toPicture(cameraOf([], { turn: 0, tilt: 1 }, 300, 200), 0, 0, 0)).toEqual([150, 100, 0]);
  });
});

describe("a robot that moves", () => {
  const [rest, turned] = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0], [0, -1, 0, 0.5, 1, 0, 0, 0, 0, 0, 1, 0.2]];
  const scene = {
    bones: [0, 1],
    links: [{ link: 1, corners: [1, 0, 0, 0, 2, 0] }],
    skins: [{ link: 1, corners: [0, 0, 1] }, { link: null, corners: [7, 8, 9] }],
  };

  it("takes with a link what lies on it, and nothing else", () => {
    expect(worldOf(scene as never, [...rest, ...turned])).toEqual({
      bones: [0, 0, 0, 0.5, 0, 0.2],
      links: [0.5, 1, 0.2, -1.5, 0, 0.2],
      skins: [[0.5, 0, 1.2], [7, 8, 9]],
    });
  });

  it("is made anew only where a link has moved", () => {
    robot.value = { ...scene, poses: [...rest, ...rest] } as never;
    follow({ skins: {}, poses: [...rest, ...turned] });
    const before = world.value;
    follow({ skins: {}, poses: [...rest, ...turned] });
    expect(world.value).toBe(before);
    expect(world.value?.links).toEqual([0.5, 1, 0.2, -1.5, 0, 0.2]);
    expect(home.value?.links).toEqual([1, 0, 0, 0, 2, 0]);
  });
});

describe("a colour", () => {
  it("is the same however the build has written it", () => {
    expect(parts("#ffffff")).toEqual([1, 1, 1]);
    expect(parts("#fff")).toEqual([1, 1, 1]);
    expect(parts("#0f8")).toEqual(parts("#00ff88"));
  });
});

describe("the row of a skin", () => {
  const touch = { id: 3, position: [0.3, -0.02, 0.05], normal: [0, 0, 1], peak: 0.1 } as const;

  it("says where each touch is, and how hard where that is known", () => {
    const found = (force: number | null, more_than: number | null = null) =>
      ({ valid: true, touches: [{ ...touch, force, more_than }], pose_problem: null }) as never;
    expect(touchLines(found(4.56))).toEqual(["touch 3 at 300, \u221220, 50 mm, 4.6 N"]);
    expect(touchLines(found(null))).toEqual(["touch 3 at 300, \u221220, 50 mm"]);
    expect(touchLines(found(9.1, 8))).toEqual(["touch 3 at 300, \u221220, 50 mm, > 8.0 N"]);
    expect(touchLines({ valid: true, touches: [], pose_problem: null })).toEqual(["no touch"]);
  });

  it("says that the robot touches itself", () => {
    const found = { valid: true, touches: [{ ...touch, force: null, more_than: null, is_self: true }], pose_problem: null };
    expect(touchLines(found as never)).toEqual(["touch 3 by the robot at 300, \u221220, 50 mm"]);
  });

  it("says no place where it is not known where the link is", () => {
    const found = { valid: true, touches: [{ ...touch, force: 2, more_than: null }], pose_problem: "pose unknown: why" };
    expect(touchLines(found as never)).toEqual(["touch 3, 2.0 N"]);
  });

  it("never says that nothing touches a skin that is not read", () => {
    expect(touchLines({ valid: false, touches: [], pose_problem: null })).toEqual(["not known"]);
    expect(touchLines(undefined)).toEqual(["not known"]);
  });
});
