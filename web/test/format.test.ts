import { describe, expect, it } from "vitest";
import { duration, fixed, inScale, millimetres, niceAbove, scaleFor } from "../src/format";
import { nameProblem } from "../src/flows/format";

it("writes a true minus, never minus zero, and a dash for nothing", () => {
  expect(fixed(-1.25, 1)).toBe("−1.3");
  expect(fixed(-0.01, 1)).toBe("0.0");
  expect(fixed(null, 1)).toBe("–");
  expect(fixed(Number.NaN, 1)).toBe("–");
  expect(millimetres(-0.0324)).toBe("−32.4");
});

describe("scaleFor", () => {
  it.each([
    [0.3, "S", "0.150", "S"],
    [3, "S", "0.15", "S"],
    [0.02, "V", "150.0", "mV"],
    [4e-6, "S", "150000.00", "µS"],
  ])("shows 0.15 against %s %s", (largest, unit, text, shown) => {
    const scale = scaleFor(largest, unit);
    expect(scale.unit).toBe(shown);
    expect(inScale(0.15, scale)).toBe(text);
  });

  it("shows relative changes in per cent", () => {
    expect(inScale(-0.153, scaleFor(0.5, "relative"))).toBe("−15");
    expect(scaleFor(0.05, "relative")).toMatchObject({ unit: "%", decimals: 1 });
  });
});

it("rounds limits up to figures that people like", () => {
  expect([0.9, 1, 1.2, 0.0203, 41, 0].map(niceAbove)).toEqual([1, 1, 1.5, 0.03, 50, 1]);
});

it("says durations at a glance", () => {
  expect([0.4, 59, 150, 7200].map(duration)).toEqual(["0 s", "59 s", "3 min", "2 h"]);
});

describe("names of files", () => {
  it("say which letters cannot be in one", () => {
    expect(nameProblem("run-2_a")).toBeNull();
    expect(nameProblem("Prüfung ß")).toMatch(/; not ü, a space, ß\.$/);
    expect(nameProblem("-a")).toMatch(/begins with a letter or a digit\.$/);
    expect(nameProblem("")).not.toBeNull();
  });
});
