import { describe, expect, it, vi } from "vitest";

vi.stubGlobal("window", { location: { href: "http://127.0.0.1/" }, setTimeout, clearTimeout });

const { doing, stands, typed } = await import("../src/settings/model");

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

it("a key stands only beside the choice that it goes with", () => {
  const key = { when: { key: "shape", words: ["disc"] }, unless: null } as never;
  expect(stands(key, { shape: "disc" })).toBe(true);
  expect(stands(key, { shape: "rectangle" })).toBe(false);
  const count = { when: null, unless: "positions" } as never;
  expect(stands(count, { positions: null })).toBe(true);
  expect(stands(count, { positions: [[0, 1]] })).toBe(false);
});

it("a change says what it is doing, and how far it is", () => {
  expect(doing({ type: "progress", stage: "image", done: 2, stages: 5 })).toBe("preparing images, 3 of 5");
  expect(doing({ type: "progress", stage: null, done: 0, stages: 5 })).toBe("preparing");
});
