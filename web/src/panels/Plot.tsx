/** A uPlot that fills its panel: made once per plan, fed by a function, redrawn when that says so. */

import { computed, effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Theme } from "../theme";

export type Plan = Omit<uPlot.Options, "width" | "height">;

export interface PlotProps {
  readonly label: string;
  /** Reads signals: the plot is made anew when one of them changes. Null: nothing to plot yet. */
  readonly plan: () => Plan | null;
  /** Reads signals: the data is set anew when one of them changes. */
  readonly data: () => uPlot.AlignedData;
}

/** Axes as all panels have them: quiet, thin, in the page's font. */
export function axis(theme: Theme, more: uPlot.Axis): uPlot.Axis {
  return {
    stroke: theme.muted,
    font: `14px ${theme.font}`,
    grid: { stroke: theme.line, width: 1 },
    ticks: { show: false },
    gap: 4,
    ...more,
  };
}

/** Keep a plot of what `plan` and `data` say, made by `make`; returns the undoing.
 *
 * One effect does both: data never meet the plot of an older plan. */
export function keepPlotted<P extends object, D>(
  plan: () => P | null,
  data: () => D,
  make: (plan: P) => { setData(data: D): void; destroy(): void },
): () => void {
  const planned = computed(plan);
  let made: P | null = null;
  let plot: ReturnType<typeof make> | null = null;
  const undo = effect(() => {
    if (made !== planned.value) {
      plot?.destroy();
      made = planned.value;
      plot = made && make(made);
    }
    plot?.setData(data());
  });
  return () => {
    undo();
    plot?.destroy();
  };
}

export function Plot({ label, plan, data }: PlotProps) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = box.current;
    if (!element) return;
    const room = () => ({ width: element.clientWidth, height: element.clientHeight });
    let plot: uPlot | null = null;
    const undo = keepPlotted(plan, data, (made) => (plot = new uPlot({ ...made, ...room() }, undefined, element)));
    const observer = new ResizeObserver(() => plot?.setSize(room()));
    observer.observe(element);
    return () => {
      observer.disconnect();
      undo();
    };
  }, [plan, data]);
  return <div ref={box} class="plot" role="img" aria-label={label} />;
}
