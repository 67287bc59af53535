/** What the server says of files, sources, guided presses and the line of time. */

import { computed, effect, signal } from "@preact/signals";
import type { EventNote, Scene } from "../protocol";
import { now, onMessage, say, scene, send, shown, status } from "../state";

export interface FoundFile {
  readonly name: string;
  readonly kind: string;
  /** Bytes. */
  readonly size: number;
  /** Seconds since 1970. */
  readonly written: number;
  /** What a person wrote about it; "" for nothing. */
  readonly notes: string;
}

interface Files {
  readonly type: "files";
  readonly files: readonly FoundFile[];
  /** Files of the same kinds that are left out: too many, or named as no page may ask. */
  readonly others: number;
  readonly recording: string | null;
  readonly playing: string | null;
  readonly exporting: string | null;
  /** 0…1 of the export. */
  readonly share: number;
}

interface Sources {
  readonly type: "sources";
  readonly sources: readonly { readonly id: string; readonly text: string }[];
  readonly current: string;
  readonly host_protocol: string;
  readonly board: {
    /** What it calls itself; empty before protocol 1.2. */
    readonly name: string;
    readonly firmware: string;
    readonly protocol: string;
    readonly channels: number;
    readonly adc_bits: number;
    readonly current_ma: number;
    readonly unique_id: string;
  } | null;
  readonly problem: string | null;
}

export type FlowKind = "touch" | "mapping" | "force" | "rub";
export type Phase = "rest" | "press" | "hold" | "release" | "several" | "name" | "rub";
export type Unit = "N" | "g" | "kg";

export interface Weight {
  readonly value: number;
  readonly unit: Unit;
  readonly newtons: number;
  readonly text: string;
}

/** What was rubbed so far. */
export interface Rubbed {
  readonly touches: number;
  /** So many can be learnt from. */
  readonly needed: number;
  /** What is missing, in words. */
  readonly text: string;
  readonly enough: boolean;
  /** x, y of each position of the map, m, flat; how many touches lay near it, and how near, m. */
  readonly places: readonly number[];
  readonly covered: readonly number[];
  readonly near_m: number;
}

export interface Flow {
  readonly type: "flow";
  readonly kind: FlowKind | null;
  readonly phase?: Phase;
  readonly dot?: readonly [number, number] | null;
  /** How to press it; null where that does not matter. */
  readonly effort?: "softly" | "hard" | null;
  readonly presses?: readonly (readonly [number, number])[];
  readonly thinking?: boolean;
  readonly text?: string;
  readonly ready?: boolean;
  readonly figures?: {
    readonly errors_mm?: readonly number[];
    readonly median_mm?: number;
    readonly doubtful?: readonly number[];
    readonly probability?: number;
    readonly mapping?: string;
    /** Relative error of each force, its press left out. */
    readonly errors?: readonly number[];
    /** What is wrong, in words. */
    readonly remarks?: readonly string[];
  };
  /** Of weights: what each was, what lies there or comes next, and what was probably mistaken. */
  readonly weights?: readonly string[];
  readonly weight?: Weight | null;
  readonly asked?: Weight | null;
  readonly meant?: Weight | null;
  readonly rubbed?: Rubbed;
  /** How far learning is, in words. */
  readonly stage?: string;
}

/** Files of the calibrations in use; "" where the name is not known; null: none. */
interface Calibrations {
  readonly type: "calibrations";
  readonly touch: string | null;
  readonly force: string | null;
  /** The largest force that was learnt from, N; null: none was. */
  readonly force_most_n: number | null;
}

export interface Timeline {
  readonly type: "timeline";
  readonly end_s: number;
  readonly notes: readonly { readonly time_s: number; readonly text: string }[];
  readonly events: readonly { readonly time_s: number; readonly kind: string; readonly text: string }[];
  readonly touches: readonly Span[];
}

export interface Span {
  readonly id: number;
  readonly kind: string;
  readonly begin_s: number;
  readonly end_s: number;
}

export interface Tick {
  readonly time_s: number;
  readonly text: string;
}

export const files = signal<Files | null>(null);
export const sources = signal<Sources | null>(null);
export const flow = signal<Flow>({ type: "flow", kind: null });
export const calibrations = signal<Calibrations>({ type: "calibrations", touch: null, force: null, force_most_n: null });
export const timeline = signal<Timeline | null>(null);
/** Notes and gaps since the recording began or the replay was opened, and its touches. */
export const marks = signal<readonly Tick[]>([]);
export const gaps = signal<readonly Tick[]>([]);
export const spans = signal<readonly Span[]>([]);
/** The last file that an export wrote. */
export const exported = signal<string | null>(null);

onMessage<Files>("files", (message) => (files.value = message));
onMessage<Sources>("sources", (message) => (sources.value = message));
onMessage<Flow>("flow", (message) => (flow.value = message));
onMessage<Calibrations>("calibrations", (message) => (calibrations.value = message));
onMessage<Timeline>("timeline", (message) => (timeline.value = message));
onMessage<{ readonly type: "exported"; readonly name: string }>("exported", ({ name }) => {
  exported.value = name;
  say(`Exported to ${name}`);
});

/** A page of an older tomoskin would not understand a newer server. */
let version: string | null = null;
onMessage<Scene>("scene", (message) => {
  if (version !== null && version !== message.version) window.location.reload();
  version = message.version;
  timeline.value = null;
  restart();
});

/** Page time, s, at which the recording began; null where nothing is recorded. */
const began = signal<number | null>(null);

/** Page time, s, at which the newest state came. */
let statusTime = 0;
effect(() => {
  void status.value;
  statusTime = now.peek();
});

function restart(): void {
  marks.value = gaps.value = spans.value = [];
}

const recording = computed(() => status.value?.recording ?? null);
effect(() => {
  began.value = recording.value === null ? null : now.peek();
  if (recording.value !== null) restart();
});

/** What the line of time is of. */
export const lineOf = computed<"replay" | "recording" | null>(() => {
  if (status.value?.replay) return "replay";
  return began.value === null ? null : "recording";
});

/** Seconds from the first frame of the replay, or since the recording began. */
export const position = computed(() => {
  const replay = status.value?.replay;
  if (replay) {
    const moving = !status.value?.paused && !replay.ended && replay.speed !== null;
    const since = moving ? Math.max(0, now.value - statusTime) * (replay.speed ?? 0) : 0;
    return Math.max(0, Math.min(replay.end_s, replay.now_s + since));
  }
  return began.value === null ? 0 : now.value - began.value;
});

/** How long it is: of a recording, as long as it has become, from a minute on. */
export const duration = computed(() => {
  const replay = status.value?.replay;
  return replay ? Math.max(replay.end_s, 0.001) : Math.max(60, 1.25 * position.value);
});

const GAP = /gap|lost|drop|behind|silent/;

onMessage<EventNote>("event", ({ kind, text }) => {
  if (lineOf.peek() === null) return;
  const tick = { time_s: position.peek(), text };
  if (kind === "note") marks.value = [...marks.value, tick];
  else if (lineOf.peek() === "recording" && GAP.test(kind)) gaps.value = [...gaps.value, tick];
});

const MOST_SPANS = 500;

/** Touches of a recording, as they come. */
effect(() => {
  const frame = shown.value;
  if (!frame || lineOf.peek() !== "recording") return;
  const at = position.peek();
  const before = spans.peek();
  const next = new Map(before.map((span) => [span.id, span]));
  for (const { id, kind } of frame.touches) {
    next.set(id, { id, kind, begin_s: next.get(id)?.begin_s ?? at, end_s: at });
  }
  if (frame.touches.length) spans.value = [...next.values()].slice(-MOST_SPANS);
});

export const allMarks = computed<readonly Tick[]>(() => [
  ...(lineOf.value === "replay" ? (timeline.value?.notes ?? []) : []),
  ...marks.value,
]);
export const allGaps = computed<readonly Tick[]>(() => [
  ...(lineOf.value === "replay"
    ? (timeline.value?.events ?? []).filter(({ kind }) => GAP.test(kind))
    : []),
  ...gaps.value,
]);
export const allSpans = computed(() =>
  lineOf.value === "replay" ? (timeline.value?.touches ?? []) : spans.value,
);

export const askFiles = (): void => send({ type: "files" });
export const askSources = (): void => send({ type: "sources" });

/** The dot of the flow, where there is one. */
export const dot = computed(() => (scene.value && flow.value.kind ? (flow.value.dot ?? null) : null));
