import { computed, effect, signal } from "@preact/signals";
import { describe, expect, it, vi } from "vitest";

vi.mock("uplot", () => ({ default: class {} }));
vi.mock("uplot/dist/uPlot.min.css", () => ({}));
const { keepPlotted } = await import("../src/panels/Plot");

describe("keepPlotted", () => {
  it("never gives data to the plot of an older plan", () => {
    const shown = signal(0);
    const forces = signal(true);
    const series = computed(() => (forces.value ? 3 : 1));
    const undoState = effect(() => {
      if (shown.value === 1) forces.value = false; // as a frame without forces does
    });
    const given: [number, number][] = [];
    let made = 0;
    const undo = keepPlotted(
      () => ({ series: series.value }),
      () => Array.from({ length: shown.value >= 0 ? series.value : 0 }),
      (plan) => {
        made++;
        return { setData: (data: unknown[]) => given.push([plan.series, data.length]), destroy: () => undefined };
      },
    );
    shown.value = 1;
    shown.value = 2;
    expect(made).toBe(2);
    expect(given.every(([wanted, got]) => wanted === got)).toBe(true);
    undo();
    undoState();
  });
});
