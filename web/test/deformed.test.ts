import { describe, expect, it } from "vitest";
import { chord, deformationInWords, foldLine, stretchArrows, truthInWords } from "../src/sheet/deformed";
import type { DeformationNow } from "../src/wire";

const SQUARE = [-1, -1, 1, -1, 1, 1, -1, 1];
const near = (value: number, degrees = 1) => ({ value, low: value - degrees, high: value + degrees });

const FOLD: DeformationNow = {
  kind: "fold",
  unit: "relative",
  axis: near(Math.PI / 2, Math.PI / 60),
  offset: near(0.02, 0.01),
  width: null,
  amount: { value: -0.14, low: -0.16, high: -0.12 },
  across: null,
  confused: null,
  text: "",
};

describe("a fold", () => {
  it("is a line across the sheet, to the right of the middle as seen along its axis", () => {
    const line = foldLine(SQUARE, Math.PI / 2, 0.25);
    expect(line?.flat().map((v) => Math.round(1e6 * v) / 1e6)).toEqual([0.25, -1, 0.25, 1]);
  });

  it("ends at the rim whatever its direction", () => {
    const line = chord(SQUARE, [0, 0], [Math.SQRT1_2, Math.SQRT1_2]);
    for (const [x, y] of line ?? []) expect(Math.max(Math.abs(x), Math.abs(y))).toBeCloseTo(1);
    expect(line).not.toBeNull();
  });

  it("is not drawn beside the sheet", () => {
    expect(foldLine(SQUARE, 0, 3)).toBeNull();
    expect(foldLine([], 0, 0)).toBeNull();
  });

  it("says its angle and how much, with intervals", () => {
    expect(deformationInWords(FOLD)).toBe("Fold at 90° ± 3°, conductance −14.0 % (−16.0 to −12.0)");
    const bent = { ...FOLD, unit: "rad" as const, amount: near(Math.PI / 9, Math.PI / 180) };
    expect(deformationInWords(bent)).toBe("Fold at 90° ± 3°, +20° (+19 to +21)");
    expect(deformationInWords({ ...FOLD, amount: null })).toBe("Fold at 90° ± 3°");
    expect(deformationInWords({ ...FOLD, kind: "unknown", axis: null })).toBe("");
  });
});

describe("a stretch", () => {
  it("is two arrows along its axis, away from each other where the sheet is longer", () => {
    const [one, other] = stretchArrows(SQUARE, 0, true);
    expect(one[1][0]).toBeGreaterThan(one[0][0]);
    expect(other[1][0]).toBeLessThan(other[0][0]);
    expect(one.concat(other).every(([, y]) => Math.abs(y) < 1e-9)).toBe(true);
    const [inward] = stretchArrows(SQUARE, 0, false);
    expect(inward[1][0]).toBeLessThan(inward[0][0]);
  });

  it("says so", () => {
    const words = deformationInWords({ ...FOLD, kind: "stretch", unit: "strain", amount: near(0.03, 0.005) });
    expect(words).toBe("Stretch along 90° ± 3°, +3.0 % (+2.5 to +3.5)");
  });
});

it("says what the twin really does", () => {
  const bend = { angle: Math.PI / 9, axis: Math.PI / 2, length: 0.06, offset: 0 };
  expect(truthInWords({ bend, stretch: null })).toBe("Truth: bent by +20° at 90°");
  expect(truthInWords({ bend: null, stretch: { along: 0.03, across: 0, axis: 0 } })).toBe(
    "Truth: stretched by +3.0 % along 0°",
  );
  expect(truthInWords({ bend: null, stretch: null })).toBe("");
});
