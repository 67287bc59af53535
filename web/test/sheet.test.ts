import { describe, expect, it } from "vitest";
import { elsewhere } from "../src/sheet/overlay";
import { contours, prepareTopology, toNodes } from "../src/sheet/topology";
import { barLength, boxOf, contains, fit, outward, toPixels, toSheet } from "../src/sheet/view";

const SQUARE = [-1, -1, 1, -1, 1, 1, -1, 1];
/** Two triangles of a square, the second clockwise. */
const POINTS = [0, 0, 2, 0, 2, 2, 0, 2];
const CELLS = [0, 1, 2, 0, 3, 2];

describe("places that the pattern cannot tell apart", () => {
  const same = { text: "", maps: [[-1, 0, 0, -1, 0.2, 0.1], [-1, 0, 0, -1, 0.2, 0.1]], least_m: 0.02 };

  it("are each shown once, and not where a touch is its own image", () => {
    expect(elsewhere({ x: 0.05, y: 0.05 }, same)).toEqual([[0.15000000000000002, 0.05]]);
    expect(elsewhere({ x: 0.101, y: 0.05 }, same)).toEqual([]);
    expect(elsewhere({ x: 0.05, y: 0.05 }, null)).toEqual([]);
  });
});

describe("the view", () => {
  const view = fit(boxOf([0, 0, 0.2, 0.1]), 800, 600, { left: 100, right: 0, top: 50, bottom: 50 });

  it("is true to scale, centred in what the margins leave, y up", () => {
    expect(view.scale).toBeCloseTo(3500);
    expect(toPixels(view, 0.1, 0.05)).toEqual([450, 300]);
    expect(toPixels(view, 0.1, 0.1)[1]).toBeLessThan(300);
  });

  it("goes there and back", () => {
    const [x, y] = toSheet(view, ...toPixels(view, 0.031, 0.087));
    expect(x).toBeCloseTo(0.031, 12);
    expect(y).toBeCloseTo(0.087, 12);
  });

  it("shortens the bar on a small sheet", () => {
    expect(barLength(boxOf([0, 0, 0.2, 0.2]))).toBe(0.05);
    expect(barLength(boxOf([0, 0, 0.05, 0.04]))).toBe(0.02);
  });
});

it("tells inside from outside", () => {
  expect(contains(SQUARE, 0.9, -0.9)).toBe(true);
  expect(contains(SQUARE, 1.1, 0)).toBe(false);
  expect(contains([], 0, 0)).toBe(false);
});

it("points out of the sheet at an electrode, whichever way its arc runs", () => {
  for (const points of [[1, 2], [2, 1], [1]]) {
    const [dx, dy] = outward(SQUARE, SQUARE, { x: 1, y: 0, points });
    expect(dx).toBeCloseTo(1);
    expect(dy).toBeCloseTo(0);
  }
});

describe("the topology", () => {
  const topology = prepareTopology(POINTS, CELLS);

  it("turns cells counter-clockwise and knows neighbours", () => {
    expect([...topology.cells]).toEqual([0, 1, 2, 0, 2, 3]);
    expect([...topology.areas]).toEqual([2, 2]);
    expect([...topology.across]).toEqual([-1, -1, 1, 0, -1, -1]);
  });

  it("averages cells at nodes by area", () => {
    const out = new Float32Array(8);
    toNodes(topology, Float32Array.of(1, 3), out);
    expect([...out.subarray(0, 4)]).toEqual([2, 1, 2, 3]);
  });

  it("walks around a region, counter-clockwise, and around nothing", () => {
    expect(contours(topology, Uint8Array.of(1, 1), 1)).toEqual([[[0, 1, 2, 3]]]);
    expect(contours(topology, Uint8Array.of(0, 2), 2)[0]).toEqual([]);
    expect(contours(topology, Uint8Array.of(0, 2), 2)[1]).toEqual([[0, 2, 3]]);
  });
});
