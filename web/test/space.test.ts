import { describe, expect, it } from "vitest";
import type { Touch } from "../src/decode";
import { History } from "../src/history";
import { ellipse, halfAxes } from "../src/sheet/overlay";
import { Locator } from "../src/sheet/locate";
import { rotation, Seen } from "../src/sheet/solid";
import { prepareTopology } from "../src/sheet/topology";
import { around, toPixels, toSheet } from "../src/sheet/view";

/** A square of 0.2 m in 20 × 20 squares, halved, and the same bent on a cylinder of 0.1 m. */
const N = 20;
const flat: number[] = [];
const bent: number[] = [];
for (let row = 0; row <= N; row++) {
  for (let column = 0; column <= N; column++) {
    const [u, v] = [(column / N - 0.5) * 0.2, (row / N - 0.5) * 0.2];
    flat.push(u, v);
    bent.push(0.1 * Math.sin(u / 0.1), v, 0.1 * Math.cos(u / 0.1));
  }
}
const cells: number[] = [];
for (let row = 0; row < N; row++) {
  for (let column = 0; column < N; column++) {
    const at = row * (N + 1) + column;
    cells.push(at, at + 1, at + N + 1, at + 1, at + N + 2, at + N + 1);
  }
}
const topology = prepareTopology(flat, cells);
const locator = new Locator(topology);

describe("a place on the mesh", () => {
  it("is found in its cell, whose weights give it back", () => {
    for (const [x, y] of [[0, 0], [0.0731, -0.0427], [-0.0999, 0.0999]]) {
      const found = locator.find(x, y);
      expect(Math.min(...(found?.weights ?? [-1]))).toBeGreaterThan(-1e-6);
      const back = [0, 1].map((axis) =>
        found?.weights.reduce((sum, w, k) => sum + w * flat[2 * cells[3 * found.cell + k] + axis], 0),
      );
      expect(back[0]).toBeCloseTo(x, 6);
      expect(back[1]).toBeCloseTo(y, 6);
    }
  });
});

describe("a sheet in space", () => {
  const seen = Seen.of(topology, locator, bent, rotation({ turn: 0.4, tilt: 0.3 }));
  const view = around(seen, 800, 600, { left: 100, right: 50, top: 50, bottom: 50 });

  it.each([[0, 0], [0.05, -0.03], [-0.02, 0.08]])("gives the pressed place back: %f, %f", (x, y) => {
    const [backX, backY] = toSheet(view, ...toPixels(view, x, y));
    expect(backX).toBeCloseTo(x, 4);
    expect(backY).toBeCloseTo(y, 4);
  });

  it("gives way into itself, true to scale, and is lit on the other side", () => {
    const counts = new Uint16Array(topology.nPoints);
    const middle = (N / 2) * (N + 1) + N / 2;
    counts[middle] = 5000;
    const dented = seen.dented(counts, 2e-6);
    const way = (node: number) => Math.hypot(...[0, 1, 2].map((k) => dented.places[3 * node + k] - seen.places[3 * node + k]));
    expect(way(middle)).toBeCloseTo(0.01, 5);
    expect(way(middle + 3)).toBe(0);
    expect(dented.places[3 * middle + 2]).toBeLessThan(seen.places[3 * middle + 2]);
    expect(dented.lit?.[middle + 5]).toBe(1);
    expect(dented.lit?.[middle - N - 1]).toBeGreaterThan(1.05); // the wall that looks up
    expect(dented.lit?.[middle + N + 1]).toBeLessThan(0.95);
  });

  it("has nothing beside it", () => {
    expect(toSheet(view, 1, 1)[0]).toBeNaN();
  });

  it("stays in its window however it is turned", () => {
    for (let turn = 0; turn < 6; turn += 0.5) {
      const other = around(
        Seen.of(topology, locator, bent, rotation({ turn, tilt: 1.2 })),
        800,
        600,
        { left: 100, right: 50, top: 50, bottom: 50 },
      );
      const [px, py] = toPixels(other, 0.1, 0.1);
      expect(px).toBeGreaterThan(99);
      expect(px).toBeLessThan(751);
      expect(py).toBeGreaterThan(49);
      expect(py).toBeLessThan(551);
    }
  });
});

describe("the ellipse of a touch", () => {
  const touch = { id: 1, x: 0.01, y: 0.02, sdX: 0.002, sdY: 0.002, covXy: 3e-6 } as Touch;

  it("lies along the covariance and holds 90 %", () => {
    const places = ellipse(touch) ?? [];
    const [det, a, b] = [4e-6 ** 2 - 3e-6 ** 2, 4e-6, 3e-6];
    for (const [x, y] of places) {
      const [dx, dy] = [x - 0.01, y - 0.02];
      expect((a * dx * dx - 2 * b * dx * dy + a * dy * dy) / det).toBeCloseTo(4.605, 3);
    }
    const [farX, farY] = places[0];
    expect((farY - 0.02) / (farX - 0.01)).toBeCloseTo(1, 6);
    const reach = Math.max(...places.map(([x, y]) => Math.hypot(x - 0.01, y - 0.02)));
    expect(halfAxes(touch)?.[0]).toBeCloseTo(reach, 6); // what the list says in words
  });

  it("is not drawn where the noise is unknown", () => {
    expect(ellipse({ ...touch, sdX: Number.NaN })).toBeNull();
  });
});

it("a trail holds the last two seconds of a touch, and no gap", () => {
  const history = new History();
  const at = (x: number) => [{ id: 7, x, y: 0, peak: 1 } as Touch];
  history.add(0, at(0));
  history.add(1, []);
  history.add(2, at(0.02));
  history.add(3, at(0.03));
  expect(history.trailOf(7)).toEqual([
    [0.02, 0],
    [0.03, 0],
  ]);
  expect(history.trailOf(8)).toEqual([]);
});
