import { describe, expect, it, vi } from "vitest";

vi.stubGlobal("window", { location: { href: "http://127.0.0.1/" }, setTimeout, clearTimeout });

const { applies, doing, parted, typed } = await import("../src/settings/model");

describe("what a person types", () => {
  it("gets the unit that was there, else the schema's", () => {
    const kind = { form: "quantity", unit: "mm" } as const;
    expect(typed("20", kind, "3 cm")).toBe("20 cm");
    expect(typed(" 20 ", kind, null)).toBe("20 mm");
    expect(typed("20 um", kind, "3 cm")).toBe("20 um");
  });

  it("is a number where a number is asked for, and is left to the server where it is none", () => {
    expect(typed("0.7", { form: "number" }, 0.6)).toBe(0.7);
    expect(typed("much", { form: "number" }, 0.6)).toBe("much");
  });
});

it("a value and its unit stand apart", () => {
  const kind = { form: "quantity", unit: "mm" } as const;
  expect(parted("3 cm", kind)).toEqual(["3", "cm"]);
  expect(parted("-1.5e3 ohm/sq", kind)).toEqual(["-1.5e3", "ohm/sq"]);
  expect(parted(null, kind)).toEqual(["", "mm"]);
  expect(parted("3 cm", { form: "text" })).toEqual(["3 cm", ""]);
});

it("a key applies beside the choice that it goes with or does anything with", () => {
  const disc = { key: "shape", words: ["disc"] };
  const goesWith = { when: disc, effective: null, unless: null } as never;
  const worksWith = { when: null, effective: disc, unless: null } as never;
  for (const key of [goesWith, worksWith]) {
    expect(applies(key, { shape: "disc" })).toBe(true);
    expect(applies(key, { shape: "rectangle" })).toBe(false);
  }
  const count = { when: null, effective: null, unless: "positions" } as never;
  expect(applies(count, { positions: null })).toBe(true);
  expect(applies(count, { positions: [[0, 1]] })).toBe(false);
});

it("a change says what it is doing, and how far it is", () => {
  expect(doing({ type: "progress", stage: "image", done: 2, stages: 5 })).toBe("preparing images, 3 of 5");
  expect(doing({ type: "progress", stage: null, done: 0, stages: 5 })).toBe("preparing");
});
