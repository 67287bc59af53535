import { describe, expect, it } from "vitest";
import { CHANGE, mapIndex, mapTable, MAP_SIZE } from "../src/colours";

/** Of values against their limit; tests/core/test_colours.py asks the library for the same. */
const KNOWN = {
  light: {
    "-1": "#0858af",
    "-0.5": "#7aadf1",
    "-0.1": "#dfecfd",
    "0": "#fafafa",
    "0.1": "#fce4e1",
    "0.5": "#e98e83",
    "1": "#a02a26",
  },
  dark: {
    "-1": "#55abf7",
    "-0.5": "#256093",
    "-0.1": "#232d38",
    "0": "#222222",
    "0.1": "#382826",
    "0.5": "#8d433d",
    "1": "#f07f76",
  },
};

const channels = (colour: string): number[] =>
  [1, 3, 5].map((k) => Number.parseInt(colour.slice(k, k + 2), 16));

describe.each(["light", "dark"] as const)("the scale on a %s ground", (ground) => {
  const table = mapTable(CHANGE[ground]);

  it.each(Object.entries(KNOWN[ground]))("has at %s the colour of the figures", (value, colour) => {
    const at = 4 * mapIndex(Number(value), 1);
    channels(colour).forEach((level, c) => {
      expect(Math.abs(table[at + c] - level)).toBeLessThanOrEqual(1);
    });
    expect(table[at + 3]).toBe(255);
  });

  it("is blue where the conductivity falls and red where it rises", () => {
    const middle = mapIndex(0, 1);
    for (let k = 0; k < MAP_SIZE; k++) {
      const [red, , blue] = table.subarray(4 * k, 4 * k + 3);
      if (k < middle) expect(blue).toBeGreaterThan(red);
      if (k > middle) expect(red).toBeGreaterThan(blue);
      if (k === middle) expect(red).toBe(blue);
    }
  });
});

it("finds a value's place and clamps beyond the limit", () => {
  expect(mapIndex(0, 2)).toBe((MAP_SIZE - 1) / 2);
  expect(mapIndex(-9, 2)).toBe(0);
  expect(mapIndex(2, 2)).toBe(MAP_SIZE - 1);
});
