/** The voltages of one frame against the reference, drive by drive; or their difference. */

import { computed, signal } from "@preact/signals";
import type uPlot from "uplot";
import { inScale, niceAbove, scaleFor } from "../format";
import { link, scene, showDifference, shown } from "../state";
import { theme } from "../theme";
import { type Grouping, groupByDrive, spread } from "./rows";
import { axis, Plot, type Plan } from "./Plot";

const grouping = computed<Grouping | null>(() =>
  scene.value ? groupByDrive(scene.value.pattern) : null,
);

/** A strong press may raise a voltage by so much without leaving the plot. */
const HEADROOM = 1.3;

/** Bounds of the reference's own pattern, V; they move only when the reference does. */
const bounds = computed<readonly [number, number]>(() => {
  const frame = shown.value;
  const base = frame?.referenceReady ? frame.reference : frame?.voltages;
  let [low, high] = [0, 0];
  for (const v of base ?? []) {
    if (v < low) low = v;
    if (v > high) high = v;
  }
  return [low && -niceAbove(-low * HEADROOM), high && niceAbove(high * HEADROOM)];
});
const lowest = computed(() => bounds.value[0]);
const highest = computed(() => bounds.value[1]);
/** "Fit axis" of the difference: V, null until asked for. */
const ownSpan = signal<number | null>(null);
const span = computed(
  () => ownSpan.value ?? niceAbove(0.1 * Math.max(-lowest.value, highest.value)),
);

function fitSpan(): void {
  const frame = shown.value;
  if (!frame?.referenceReady) return;
  let largest = 0;
  frame.voltages.forEach((v, k) => (largest = Math.max(largest, Math.abs(v - frame.reference[k]))));
  if (largest > 0) ownSpan.value = niceAbove(largest);
}

/** Thin lines between drives, and each drive's name under its rows. */
function separators(groups: Grouping): (plot: uPlot) => void {
  return (plot) => {
    const { ctx, bbox } = plot;
    const { line } = theme.peek();
    ctx.save();
    ctx.strokeStyle = line;
    ctx.lineWidth = window.devicePixelRatio;
    ctx.beginPath();
    for (const { from } of groups.drives.slice(1)) {
      const x = Math.round(plot.valToPos(from - 1, "x", true)) + 0.5;
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
    }
    ctx.stroke();
    ctx.restore();
  };
}

/** With more rows than this the dots would run into one another. */
const MOST_DOTS = 100;

/** A drive's label takes as many of the canvas's pixels. */
const LABEL_ROOM = 38 * window.devicePixelRatio;

function plan(): Plan | null {
  const groups = grouping.value;
  if (!groups || highest.value === lowest.value) return null;
  const colours = theme.value;
  const difference = showDifference.value;
  const [low, high] = difference ? [-span.value, span.value] : [lowest.value, highest.value];
  const scale = scaleFor(high, "V");
  const middles = groups.drives.map(({ from, to }) => (from + to) / 2);
  const point = { show: groups.rows.length < MOST_DOTS, size: 4, fill: colours.ink, stroke: colours.ink };
  return {
    legend: { show: false },
    cursor: { show: false },
    padding: [6, 4, 0, 0],
    scales: { x: { time: false, range: [-1, groups.places.length] }, y: { range: [low, high] } },
    axes: [
      axis(colours, {
        size: 24,
        gap: 6,
        grid: { show: false },
        splits: () => middles,
        filter: (_, splits) => splits,
        values: (plot) => {
          const every = Math.ceil((groups.drives.length * LABEL_ROOM) / plot.bbox.width);
          return groups.drives.map(({ label }, k) => (k % every ? "" : label));
        },
      }),
      axis(colours, {
        size: 52,
        space: 28,
        values: (_, splits) => splits.map((v) => (v === 0 ? "0" : inScale(v, scale))),
      }),
    ],
    series: [
      {},
      { stroke: colours.muted, width: 3, points: { show: false }, alpha: 0.45 },
      { stroke: colours.ink, width: 1.25, points: point },
    ],
    hooks: { drawClear: [separators(groups)] },
  };
}

function data(): uPlot.AlignedData {
  const groups = grouping.value;
  const frame = shown.value;
  if (!groups || !frame) return [[], [], []];
  const { voltages, reference, referenceReady } = frame;
  const base = (row: number) => (referenceReady ? reference[row] : Number.NaN);
  const places = [...groups.places];
  return showDifference.value
    ? [places, spread(groups, () => 0), spread(groups, (row) => voltages[row] - base(row))]
    : [places, spread(groups, base), spread(groups, (row) => voltages[row])];
}

export function Voltages() {
  const unit = scaleFor(showDifference.value ? span.value : highest.value, "V").unit;
  const choose = (difference: boolean) => () => (showDifference.value = difference);
  return (
    <section
      class={`panel${link.value.phase === "lost" ? " stale" : ""}`}
      aria-labelledby="voltages-title"
    >
      <h2 id="voltages-title">
        Voltages, {unit}
        {!showDifference.value && (
          <span class="key">
            — now <i>— reference</i>
          </span>
        )}
        <span class="choice" role="group" aria-label="What is plotted">
          <button type="button" aria-pressed={!showDifference.value} onClick={choose(false)}>
            Pattern
          </button>
          <button type="button" aria-pressed={showDifference.value} onClick={choose(true)}>
            Difference
          </button>
          {showDifference.value && (
            <button type="button" title="Fit the axis to what is shown now, once" onClick={fitSpan}>
              Fit axis
            </button>
          )}
        </span>
      </h2>
      <Plot
        label="Voltage of each measurement, grouped by drive, with the reference behind it"
        plan={plan}
        data={data}
      />
    </section>
  );
}
