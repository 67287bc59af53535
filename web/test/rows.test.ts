import { describe, expect, it } from "vitest";
import { countDrives, fresh, fromPattern, fromText, problems, type Row, toTables } from "../src/pattern/rows";

const rows = (...lines: string[]): Row[] => fromText(lines.join("\n")) ?? [];
const words = (found: readonly Row[]): (string | undefined)[] => {
  const wrong = problems(found, 8);
  return found.map(({ id }) => wrong.get(id));
};

describe("the rows of a pattern", () => {
  it("count from 1 as people do", () => {
    expect(toTables(rows("2 1 4 5", "E3, E2; e5\tE6", ""))).toEqual({
      drive: [
        [1, 0],
        [2, 1],
      ],
      measure: [
        [3, 4],
        [4, 5],
      ],
    });
  });

  it("are those of the skin to begin with", () => {
    const pattern = { name: "x", n_meas: 2, n_drive: 1, drive: [1, 0, 1, 0], measure: [2, 3, 3, 4] };
    const found = fromPattern(pattern);
    expect(found.map(({ cells }) => cells.join(" "))).toEqual(["2 1 3 4", "2 1 4 5"]);
    expect(countDrives(found)).toBe(1);
    expect(new Set(found.map(({ id }) => id)).size).toBe(2);
  });

  it.each(["", "1 2 3", "1 2 3 4\n1 2"])("are not made of %j", (text) => {
    expect(fromText(text)).toBeNull();
  });
});

describe("what is wrong with a row", () => {
  it("is nothing with different pairs and drives", () => {
    expect(words(rows("2 1 4 5", "2 1 5 6", "1 2 4 5"))).toEqual([undefined, undefined, undefined]);
  });

  it("is said in words", () => {
    const found = [...rows("9 1 4 5", "2 2 4 5", "2 1 4 4", "2 1 x 5", "0 1 4 5"), fresh(["", "", "", ""])];
    expect(words(found)).toEqual([
      "drive +: this skin has E1 to E8, not E9",
      "drive + and drive − are both E2",
      "read + and read − are both E4",
      "read +: expected an electrode from E1 to E8, got “x”",
      "drive +: this skin has E1 to E8, not E0",
      "drive +: expected an electrode from E1 to E8, got “”",
    ]);
  });

  it("is a measurement that stands there already, whichever way round", () => {
    expect(words(rows("2 1 4 5", "3 2 4 5", "2 1 5 4"))).toEqual([
      undefined,
      undefined,
      "measures the same pair under the same drive as row 1",
    ]);
  });
});
