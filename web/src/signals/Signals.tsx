/** The signals drawer: the pattern drive by drive, noise, drift, reciprocity, positions of touches. */

import { computed, effect, signal } from "@preact/signals";
import type { JSX } from "preact";
import type uPlot from "uplot";
import { addDrawer, opened } from "../drawers";
import { fixed, niceAbove } from "../format";
import { SLOTS, SPAN } from "../history";
import { axis, Plot, type Plan } from "../panels/Plot";
import { groupByDrive, spread } from "../panels/rows";
import { history, newest, onFrame, onMessage, scene, shown } from "../state";
import { shownDrive } from "../sheet/space";
import { theme } from "../theme";
import { Budget } from "./Budget";
import { Log, NoiseMeter, reciprocalPairs, reciprocity } from "./measures";
import { Unresolved, wanted } from "./unresolved";

const DRIFT_PERIOD = 2;
const HOUR = 3600;

const noise = new NoiseMeter();
const drift = new Log(DRIFT_PERIOD, HOUR / DRIFT_PERIOD);
onFrame((frame) => noise.add(frame.voltages));
onMessage("state", ({ baseline }) =>
  drift.add(performance.now() / 1e3, baseline?.drift == null ? null : 100 * baseline.drift),
);

const pairs = computed(() => (scene.value ? reciprocalPairs(scene.value.pattern) : []));
const groups = computed(() => (scene.value ? groupByDrive(scene.value.pattern) : null));

interface Tab {
  readonly id: string;
  readonly label: string;
  readonly unit: string;
  readonly meaning: string;
  /** Ends of the ordinate, in the unit, at first and after "Fit axis". */
  readonly fit: () => readonly [number, number];
  readonly range: readonly [number, number];
  readonly data: () => uPlot.AlignedData;
  readonly points?: boolean;
  readonly series: number;
}

/** Rows of the drive that is chosen; of all where none is. */
const drives = computed(() => groups.value?.drives ?? []);
const chosen = signal(0);

const largest = (values: Iterable<number | null | undefined>): number => {
  let most = 0;
  for (const value of values) if (value != null && Number.isFinite(value)) most = Math.max(most, Math.abs(value));
  return most;
};

function driveData(): uPlot.AlignedData {
  const drive = drives.value[chosen.value];
  const frame = shown.value;
  if (!drive || !groups.value || !frame) return [[], [], []];
  const rows = groups.value.rows.slice(drive.from, drive.to + 1);
  const milli = (values: Float32Array) => rows.map((row) => 1e3 * values[row]);
  return [rows.map((_, k) => k), milli(frame.reference), milli(frame.voltages)];
}

function noiseData(): uPlot.AlignedData {
  void shown.value;
  const all = groups.value;
  return all ? [[...all.places], spread(all, (row) => 1e6 * noise.of(row))] : [[], []];
}

function driftData(): uPlot.AlignedData {
  void shown.value;
  const end = performance.now() / 1e3;
  return [drift.times.map((time) => (time - end) / 60), drift.values];
}

function reciprocityData(): uPlot.AlignedData {
  const frame = shown.value;
  if (!frame) return [[], []];
  const errors = reciprocity(pairs.value, frame.referenceReady ? frame.reference : frame.voltages);
  return [errors.map((_, k) => k), errors.map((error) => 100 * error)];
}

function wayData(): uPlot.AlignedData {
  void shown.value;
  const end = newest.frame?.hostTime ?? 0;
  const milli = (column: (number | null)[]) => column.map((v) => (v === null ? null : 1e3 * v));
  return [history.times.map((t) => t - end), ...history.xs.map(milli), ...history.ys.map(milli)];
}

function sheetSpan(): readonly [number, number] {
  const most = 1e3 * largest(scene.value?.outline ?? [0.1]);
  return [-most, most];
}

const TABS: readonly Tab[] = [
  {
    id: "drive",
    label: "Drive",
    unit: "mV",
    meaning: "Voltages of one drive (thin) against the reference (broad). The arrow on the sheet runs from the source to the sink.",
    fit: () => {
      const frame = shown.peek();
      const top = niceAbove(1.2e3 * largest(frame?.reference ?? []));
      return [Math.min(0, ...(frame?.reference ?? [])) < 0 ? -top : 0, top];
    },
    range: [-0.5, 0],
    data: driveData,
    points: true,
    series: 2,
  },
  {
    id: "noise",
    label: "Noise",
    unit: "µV",
    meaning: "Standard deviation of each measurement from one frame to the next, drive by drive.",
    fit: () => [0, niceAbove(1.5 * largest(noiseData()[1]))],
    range: [-1, 0],
    data: noiseData,
    series: 1,
  },
  {
    id: "drift",
    label: "Drift",
    unit: "%",
    meaning: "How far the untouched voltages have drifted from the reference, over the last hour (minutes).",
    fit: () => [0, niceAbove(Math.max(0.1, 1.5 * largest(driftData()[1])))],
    range: [-60, 0],
    data: driftData,
    series: 1,
  },
  {
    id: "reciprocity",
    label: "Reciprocity",
    unit: "%",
    meaning: "With drive and measuring pair exchanged, a measurement must read the same. These are the differences, relative to the mean.",
    fit: () => {
      const top = niceAbove(Math.max(0.1, 1.3 * largest(reciprocityData()[1])));
      return [-top, top];
    },
    range: [-1, 0],
    data: reciprocityData,
    points: true,
    series: 1,
  },
  {
    id: "way",
    label: "Position",
    unit: "mm",
    meaning: "x (full) and y (dashed) of each touch over the last ten seconds.",
    fit: sheetSpan,
    range: [-SPAN, 0],
    data: wayData,
    series: 2 * SLOTS,
  },
  {
    id: "unresolved",
    label: "Left open",
    unit: "%",
    meaning:
      "What the data cannot tell. The sheet shows how much of a change about each position stays open, by the prior and the alpha of the image: 0 % where the data decide it, 100 % where they say nothing. Touches do not move this map; lost electrodes and alpha do.",
    fit: () => [0, 100],
    range: [0, 1],
    data: () => [[], []],
    series: 1,
  },
  {
    id: "latency",
    label: "Latency",
    unit: "ms",
    meaning: "How long each stage of the last frames took, from the sample to the screen.",
    fit: () => [0, 1],
    range: [0, 1],
    data: () => [[], []],
    series: 1,
  },
];

const current = signal<Tab>(TABS[0]);
/** Ends of the ordinates; they move when asked to only. */
const ends = signal<Readonly<Record<string, readonly [number, number]>>>({});
const fitAxis = (): void => void (ends.value = { ...ends.peek(), [current.peek().id]: current.peek().fit() });

effect(() => {
  const showing = opened.value?.id === "signals" && current.value.id === "drive";
  const drive = drives.value[chosen.value];
  if (!showing || !drive || !scene.value || !groups.value) {
    shownDrive.value = null;
    return;
  }
  const row = groups.value.rows[drive.from];
  shownDrive.value = [scene.value.pattern.drive[2 * row], scene.value.pattern.drive[2 * row + 1]];
});
effect(() => void (wanted.value = opened.value?.id === "signals" && current.value.id === "unresolved"));
effect(() => {
  const known = ends.value[current.value.id];
  if (opened.value?.id === "signals" && !known && shown.value) fitAxis();
});

const length = computed(() => {
  const tab = current.value;
  if (tab.id === "drive") {
    const drive = drives.value[chosen.value];
    return drive ? drive.to - drive.from + 0.5 : 1;
  }
  if (tab.id === "noise") return groups.value?.places.length ?? 1;
  return tab.id === "reciprocity" ? pairs.value.length : 0;
});

/** What is read at each place of the drive that is shown. */
function pairNames(): (places: readonly number[]) => string[] {
  const drive = drives.value[chosen.value];
  const [all, measure] = [groups.value, scene.value?.pattern.measure ?? []];
  return (places) =>
    places.map((place) => {
      const row = drive && Number.isInteger(place) ? (all?.rows[drive.from + place] ?? -1) : -1;
      return row < 0 || place > length.value ? "" : `${measure[2 * row] + 1}–${measure[2 * row + 1] + 1}`;
    });
}

function plan(): Plan | null {
  const tab = current.value;
  const names = tab.id === "drive" ? pairNames() : null;
  const range = ends.value[tab.id];
  if (!range) return null;
  const colours = theme.value;
  const right = tab.range[1] || length.value;
  const dots = { show: tab.points === true && length.value < 100, size: 5, fill: colours.ink, stroke: colours.ink };
  const line = (k: number): uPlot.Series => {
    if (tab.id === "way") {
      return { stroke: colours.accent, width: 2, points: { show: false }, ...(k >= SLOTS ? { dash: [5, 4] } : {}) };
    }
    const broad = tab.series === 2 && k === 0;
    return broad
      ? { stroke: colours.muted, width: 4, alpha: 0.45, points: { show: false } }
      : { stroke: colours.ink, width: 1.5, points: dots };
  };
  return {
    legend: { show: false },
    cursor: { show: false },
    padding: [8, 10, 0, 0],
    scales: { x: { time: false, range: [tab.range[0], right] }, y: { range: [range[0], range[1]] } },
    axes: [
      axis(colours, { size: 26, gap: 6, ...(names ? { values: (_, at) => names(at) } : {}) }),
      axis(colours, { size: 56, space: 34 }),
    ],
    series: [{}, ...Array.from({ length: tab.series }, (_, k) => line(k))],
  };
}
const data = (): uPlot.AlignedData => current.value.data();

function Drives() {
  const drive = drives.value[chosen.value];
  const step = (by: number) => () => {
    chosen.value = (chosen.value + by + drives.value.length) % drives.value.length;
  };
  return (
    <div class="doing" role="group" aria-label="Drive">
      <button type="button" aria-label="Drive before" onClick={step(-1)}>
        ‹
      </button>
      <output data-testid="drive">E{drive?.label.replace("–", " to E")}</output>
      <button type="button" aria-label="Next drive" data-testid="next-drive" onClick={step(1)}>
        ›
      </button>
    </div>
  );
}

/** One number that sums the plot up. */
function summary(tab: Tab): string {
  const column = tab.data()[tab.series === 2 ? 2 : 1] as (number | null)[];
  const known = column.filter((v): v is number => v != null && Number.isFinite(v));
  if (!known.length || tab.id === "way") return "";
  if (tab.id === "drift") return `now ${fixed(known[known.length - 1], 2)} %`;
  const rms = Math.sqrt(known.reduce((sum, v) => sum + v * v, 0) / known.length);
  return `rms ${fixed(rms, rms < 10 ? 2 : 0)} ${tab.unit}`;
}

function Chart({ tab }: { tab: Tab }) {
  return (
    <>
      <p class="sum">
        <span>{tab.unit}</span>
        <strong data-testid="signals-sum">{summary(tab)}</strong>
        <button type="button" onClick={fitAxis}>
          Fit axis
        </button>
      </p>
      <Plot label={`${tab.label}, ${tab.unit}`} plan={plan} data={data} />
    </>
  );
}

/** Tabs that are no plots. */
const OWN: Readonly<Record<string, () => JSX.Element>> = {
  latency: () => <Budget />,
  unresolved: () => <Unresolved />,
};

function View() {
  const tab = current.value;
  void shown.value;
  return (
    <div class="signals">
      <div class="kinds" role="group" aria-label="What is shown">
        {TABS.map((each) => (
          <button
            key={each.id}
            type="button"
            data-testid={`signals-${each.id}`}
            aria-pressed={each === tab}
            onClick={() => (current.value = each)}
          >
            {each.label}
          </button>
        ))}
      </div>
      <p class="hint">{tab.meaning}</p>
      {tab.id === "drive" && <Drives />}
      {(OWN[tab.id] ?? (() => <Chart tab={tab} />))()}
    </div>
  );
}

addDrawer({
  id: "signals",
  label: "Signals",
  key: "G",
  title: "Voltages drive by drive, noise, drift, reciprocity, positions, what is left open, latency",
  View,
});
