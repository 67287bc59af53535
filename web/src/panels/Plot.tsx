/** A uPlot that fills its panel: made once per plan, fed by a function, redrawn when that says so. */

import { effect } from "@preact/signals";
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

export function Plot({ label, plan, data }: PlotProps) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = box.current;
    if (!element) return;
    const room = () => ({ width: element.clientWidth, height: element.clientHeight });
    let plot: uPlot | null = null;
    const undo = effect(() => {
      const wanted = plan();
      plot?.destroy();
      plot = wanted ? new uPlot({ ...wanted, ...room() }, undefined, element) : null;
    });
    // After the plan's effect, so that new data always finds the new plot.
    const undoData = effect(() => {
      void plan();
      plot?.setData(data());
    });
    const observer = new ResizeObserver(() => plot?.setSize(room()));
    observer.observe(element);
    return () => {
      observer.disconnect();
      undoData();
      undo();
      plot?.destroy();
    };
  }, [plan, data]);
  return <div ref={box} class="plot" role="img" aria-label={label} />;
}
