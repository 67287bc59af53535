/** The strength of each touch over the last ten seconds, each line named at its end. */

import { computed } from "@preact/signals";
import type uPlot from "uplot";
import { inScale, niceAbove, scaleFor } from "../format";
import { SLOTS, SPAN } from "../history";
import { history, limit, link, newest, scene, shown } from "../state";
import { theme } from "../theme";
import { axis, Plot, type Plan } from "./Plot";

/** Names of more times would run into one another, px. */
const NARROW = 320;

/** A touch is stronger than the image of it, by about so much at first. */
const HEADROOM = 5;

/** The end of the ordinate: it follows the colour scale, and moves for nothing else. */
const top = computed(() => niceAbove(HEADROOM * limit.value));
const scale = computed(() => scaleFor(top.value, scene.value?.unit ?? "S"));

/** The touch's number where its line ends. */
function nameLines(plot: uPlot): void {
  const { ctx } = plot;
  const colours = theme.peek();
  const density = window.devicePixelRatio;
  ctx.save();
  ctx.font = `600 ${14 * density}px ${colours.font}`;
  ctx.fillStyle = colours.accent;
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  const last = history.times.length - 1;
  const x = plot.bbox.left + plot.bbox.width + 7 * density;
  const ends = history.columns.flatMap((column, slot) => {
    const value = column[last] ?? null;
    if (value === null) return [];
    return { text: String(history.idOf(slot)), y: plot.valToPos(Math.min(value, top.peek()), "y", true) };
  });
  let above = -Infinity;
  for (const { text, y } of ends.sort((a, b) => a.y - b.y)) {
    above = Math.max(y, above + 14 * density);
    ctx.fillText(text, x, above);
  }
  ctx.restore();
}

function plan(): Plan | null {
  const colours = theme.value;
  const end = top.value;
  const shownScale = scale.value;
  return {
    legend: { show: false },
    cursor: { show: false },
    padding: [6, 26, 0, 0],
    scales: { x: { time: false, range: [-SPAN, 0] }, y: { range: [0, end] } },
    axes: [
      axis(colours, {
        size: 26,
        gap: 8,
        splits: (plot) => (plot.width < NARROW ? [-10, 0] : [-10, -8, -6, -4, -2, 0]),
        values: (_, splits) => splits.map((v) => (v === 0 ? "now" : `−${-v} s`)),
      }),
      axis(colours, {
        size: 52,
        splits: () => [0, end / 2, end],
        values: (_, splits) => splits.map((v) => (v === 0 ? "0" : inScale(v, shownScale))),
      }),
    ],
    series: [
      {},
      ...Array.from({ length: SLOTS }, () => ({
        stroke: colours.accent,
        width: 2,
        points: { show: false },
      })),
    ],
    hooks: { draw: [nameLines] },
  };
}

function data(): uPlot.AlignedData {
  void shown.value;
  const end = newest.frame?.hostTime ?? 0;
  const most = top.value;
  // What exceeds the end runs along the upper edge rather than out of sight.
  const columns = history.columns.map((column) =>
    column.map((value) => (value === null ? null : Math.min(value, most))),
  );
  return [history.times.map((time) => time - end), ...columns];
}

export function Strength() {
  return (
    <section
      class={`panel${link.value.phase === "lost" ? " stale" : ""}`}
      aria-labelledby="strength-title"
    >
      <h2 id="strength-title">Strength, {scale.value.unit}</h2>
      <Plot label="Strength of each touch over the last ten seconds" plan={plan} data={data} />
    </section>
  );
}
