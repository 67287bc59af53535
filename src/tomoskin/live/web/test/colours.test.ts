import { describe, expect, it } from "vitest";
import { DARK_MAP, evenArm, LIGHT_MAP, mapIndex, mapTable, MAP_SIZE, oklabToRgb } from "../src/colours";

describe.each([
  ["light", LIGHT_MAP],
  ["dark", DARK_MAP],
])("the %s map", (_, design) => {
  const arm = evenArm(design, 50);

  it("takes steps of equal perceptual length", () => {
    const steps = arm.slice(1).map(([l, c], k) => Math.hypot(l - arm[k][0], c - arm[k][1]));
    expect(Math.max(...steps) / Math.min(...steps)).toBeLessThan(1.05);
  });

  it("stays inside sRGB on both arms", () => {
    for (const hue of design.hues) {
      for (const [lightness, chroma] of arm) {
        const angle = (hue * Math.PI) / 180;
        for (const channel of oklabToRgb(lightness, chroma * Math.cos(angle), chroma * Math.sin(angle))) {
          expect(channel).toBeGreaterThan(-0.005);
          expect(channel).toBeLessThan(1.005);
        }
      }
    }
  });

  it("is grey at zero and runs one way in lightness", () => {
    const table = mapTable(design);
    const zero = 4 * ((MAP_SIZE - 1) / 2);
    const [red, green, blue] = table.subarray(zero, zero + 3);
    expect(Math.max(red, green, blue) - Math.min(red, green, blue)).toBeLessThanOrEqual(1);
    const rising = Math.sign(design.pole.lightness - design.neutral);
    arm.slice(1).forEach(([l], k) => expect(rising * (l - arm[k][0])).toBeGreaterThan(0));
  });

  it("is told apart without red-green vision: blue against red leads each arm", () => {
    const table = mapTable(design);
    const last = table.length - 4;
    expect(table[2] - table[0]).toBeGreaterThan(60);
    expect(table[last] - table[last + 2]).toBeGreaterThan(60);
  });
});

it("finds a value's place and clamps beyond the limit", () => {
  expect(mapIndex(0, 2)).toBe((MAP_SIZE - 1) / 2);
  expect(mapIndex(-9, 2)).toBe(0);
  expect(mapIndex(2, 2)).toBe(MAP_SIZE - 1);
});

it("converts OKLab's white and black", () => {
  oklabToRgb(1, 0, 0).forEach((channel) => expect(channel).toBeCloseTo(1, 3));
  oklabToRgb(0, 0, 0).forEach((channel) => expect(channel).toBeCloseTo(0, 6));
});
