/** Force or depth of each touch over the last ten seconds with its interval, or its change of the sheet;
 * each line named at its end. */

import { computed } from "@preact/signals";
import type uPlot from "uplot";
import { inScale, niceAbove, type Scale, scaleFor } from "../format";
import { SLOTS, SPAN } from "../history";
import { history, limit, link, newest, scene, shown } from "../state";
import { theme } from "../theme";
import { MEASURANDS } from "../words";
import { most, next, several, showNext, shownAs } from "./amounts";
import { axis, Plot, type Plan } from "./Plot";

/** Names of more times would run into one another, px. */
const NARROW = 320;

/** A touch is stronger than the image of it, by about so much at first. */
const HEADROOM = 5;

/** The end of the ordinate: it follows the colour scale or the calibration, and moves for nothing else. */
const top = computed(() => (shownAs.value === "change" ? niceAbove(HEADROOM * limit.value) : most.value));
const scale = computed<Scale>(() => {
  const name = shownAs.value;
  if (name === "change") return scaleFor(top.value, scene.value?.unit ?? "S");
  const { perUnit, unit } = MEASURANDS[name];
  return { factor: perUnit, unit, decimals: perUnit * top.value < 5 ? 1 : 0 };
});
/** The columns of what is shown, with the ends of its intervals where it has some. */
const amounts = computed(() => (shownAs.value === "change" ? null : history.amounts[shownAs.value]));
const lines = computed(() => amounts.value?.values ?? history.columns);

/** The touch's number where its line ends, with an arrow where it goes on above. */
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
  const ends = lines.peek().flatMap((column, slot) => {
    const value = column[last] ?? null;
    if (value === null) return [];
    const beyond = value > top.peek() ? "↑" : "";
    return { text: `${history.idOf(slot)}${beyond}`, y: plot.valToPos(Math.min(value, top.peek()), "y", true) };
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
      ...Array.from({ length: amounts.value ? 2 * SLOTS : 0 }, () => ({
        width: 0,
        points: { show: false },
      })),
    ],
    bands: intervals(colours.accent),
    hooks: { draw: [nameLines] },
  };
}

/** Between the ends of each interval, which stand behind all lines. */
function intervals(colour: string): uPlot.Band[] {
  if (!amounts.value) return [];
  return Array.from({ length: SLOTS }, (_, slot) => {
    const low = 1 + SLOTS + slot;
    return { series: [low + SLOTS, low] as [number, number], fill: `${colour}40` };
  });
}

function data(): uPlot.AlignedData {
  void shown.value;
  const end = newest.frame?.hostTime ?? 0;
  const highest = top.value;
  const ends = amounts.value ? [...amounts.value.lows, ...amounts.value.highs] : [];
  // What exceeds the end runs along the upper edge rather than out of sight.
  const columns = [...lines.value, ...ends].map((column) =>
    column.map((value) => (value === null ? null : Math.min(value, highest))),
  );
  return [history.times.map((time) => time - end), ...columns];
}

function Title() {
  if (!several.value) return <>{what()}, {scale.value.unit}</>;
  return (
    <button
      type="button"
      class="quiet"
      data-testid="strength-unit"
      title={next.value}
      onClick={showNext}
    >
      {what()}, {scale.value.unit}
    </button>
  );
}

const what = () => (shownAs.value === "change" ? "Strength" : MEASURANDS[shownAs.value].title);

export function Strength() {
  return (
    <section
      class={`panel${link.value.phase === "lost" ? " stale" : ""}`}
      aria-labelledby="strength-title"
    >
      <h2 id="strength-title">
        <Title />
      </h2>
      <Plot label={`${what()} of each touch over the last ten seconds`} plan={plan} data={data} />
    </section>
  );
}
