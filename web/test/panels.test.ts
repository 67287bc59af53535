import { describe, expect, it } from "vitest";
import type { Touch } from "../src/decode";
import { History, SLOTS } from "../src/history";
import { groupByDrive, spread } from "../src/panels/rows";
import { amountInWords } from "../src/words";

describe("rows by drive", () => {
  const grouping = groupByDrive({
    name: "adjacent",
    n_meas: 4,
    n_drive: 2,
    drive: [1, 0, 1, 0, 2, 1, 2, 1],
    measure: [2, 3, 3, 4, 3, 4, 4, 0],
  });

  it("leaves a gap between drives and names them as people count", () => {
    expect(grouping.rows).toEqual([0, 1, -1, 2, 3]);
    expect(grouping.drives).toEqual([
      { label: "2–1", from: 0, to: 1 },
      { label: "3–2", from: 3, to: 4 },
    ]);
  });

  it("spreads values, empty in gaps and where there is none", () => {
    expect(spread(grouping, (row) => (row === 3 ? Number.NaN : row))).toEqual([0, 1, null, 2, null]);
  });
});

describe("what strengths are shown as", () => {
  it("is told with its interval, and as more where the interval has no end", () => {
    expect(amountInWords({ value: 8.5e-4, low: 7e-4, high: 1.04e-3 }, "depth")).toBe("0.85 millimetres deep, 0.70 to 1.04");
    expect(amountInWords({ value: 9, low: 8, high: Infinity }, "force")).toBe("more than 8.0 newtons, beyond what was taught");
  });
});

describe("history", () => {
  const touch = (id: number, peak: number) => ({ id, peak }) as Touch;

  it("keeps each touch in one column, by strength", () => {
    const history = new History();
    history.add(0, [touch(4, -2)]);
    history.add(1, [touch(9, 1), touch(4, -3)]);
    expect(history.columns[0]).toEqual([2, 3]);
    expect(history.columns[1]).toEqual([null, 1]);
    expect([history.idOf(0), history.idOf(1)]).toEqual([4, 9]);
  });

  it("keeps forces and depths with their intervals beside, and nothing where there is none", () => {
    const history = new History();
    const force = { value: 4, low: 3, high: 6 };
    const depth = { value: 1e-3, low: 8e-4, high: Infinity };
    history.add(0, [{ ...touch(4, -2), force, depth }, touch(5, 1)]);
    history.add(1, []);
    const { values, lows, highs } = history.amounts.force;
    expect([values[0], lows[0], highs[0]]).toEqual([[4, null], [3, null], [6, null]]);
    expect(history.amounts.depth.values[0]).toEqual([1e-3, null]);
    expect(values[1]).toEqual([null, null]);
  });

  it("forgets what is older than the span, and reuses its slot", () => {
    const history = new History();
    history.add(0, [touch(1, 1)]);
    for (let t = 1; t <= 12; t++) history.add(t, t > 11 ? [touch(2, 1)] : []);
    history.trim();
    expect(history.times[0]).toBe(2);
    expect(history.idOf(0)).toBe(2);
    expect(history.columns.every((column) => column.length === history.times.length)).toBe(true);
  });

  it("starts afresh when time runs backwards, and takes no more than its slots", () => {
    const history = new History();
    history.add(50, [touch(1, 1)]);
    history.add(3, Array.from({ length: SLOTS + 2 }, (_, id) => touch(id, 1)));
    expect(history.times).toEqual([3]);
    expect(history.columns.every((column) => column[0] === 1)).toBe(true);
  });
});
