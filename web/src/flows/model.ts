/** What the server says of files, sources, guided presses and the line of time. */

import { computed, effect, signal } from "@preact/signals";
import { opened } from "../drawers";
import { link, now, onMessage, say, scene, send, shown, status } from "../state";
import type { Calibrations, EventNote, Files, FlowNow, PlayedTimeline, Sources, Span } from "../wire";

export type Phase = FlowNow["phase"];

const NO_FLOW: FlowNow = {
  type: "flow",
  offered: [],
  kind: null,
  paused: false,
  phase: "rest",
  dot: null,
  presses: [],
  thinking: false,
  text: "",
  ready: false,
  figures: {},
  effort: null,
  labels: [],
  label: null,
  asked: null,
  meant: null,
  rubbed: null,
  stage: "",
};

export const files = signal<Files | null>(null);
export const sources = signal<Sources | null>(null);
export const flow = signal<FlowNow>(NO_FLOW);
export const calibrations = signal<Calibrations>({ type: "calibrations", touch: null, force: null, depth: null, most: {} });
export const timeline = signal<PlayedTimeline | null>(null);
/** Notes and gaps since the recording began or the replay was opened, and its touches. */
/** A moment of a recording, from its first frame, and what happened. */
export type Tick = Pick<EventNote, "time_s" | "text">;

export const marks = signal<readonly Tick[]>([]);
export const gaps = signal<readonly Tick[]>([]);
export const spans = signal<readonly Pick<Span, "id" | "kind" | "begin" | "end">[]>([]);
/** The recording that was asked for, until its first frame can be shown; a skin is made for it. */
export const opening = signal<string | null>(null);
onMessage("error", () => (opening.value = null));
/** The last file that an export wrote. */
export const exported = signal<string | null>(null);

onMessage("files", (message) => (files.value = message));
onMessage("sources", (message) => (sources.value = message));
onMessage("flow", (message) => (flow.value = message));
onMessage("calibrations", (message) => (calibrations.value = message));
onMessage("timeline", (message) => (timeline.value = message));
onMessage("exported", ({ name }) => {
  exported.value = name;
  say(`Exported to ${name}`);
});

/** A page of an older tomoskin would not understand a newer server. */
let version: string | null = null;
onMessage("scene", (message) => {
  if (version !== null && version !== message.version) window.location.reload();
  version = message.version;
  timeline.value = opening.value = null;
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

onMessage("event", ({ kind, text }) => {
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
    next.set(id, { id, kind, begin: next.get(id)?.begin ?? at, end: at });
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

export type Step = "board" | "mapping" | "touch" | "force" | "depth";

/** The step that the set-up drawer shows. */
export const step = signal<Step>("board");

const TAUGHT: readonly Step[] = ["mapping", "touch", "force", "depth"];

/** The step that a flow belongs to: its own, or that of touch. */
export const stepOf = (kind: string): Step => TAUGHT.find((step) => step === kind) ?? "touch";

const going = computed(() => flow.value.kind);

/** Whether this page shows the flow: the server records nothing while no page does. */
const shows = computed(() => {
  const kind = going.value;
  return kind !== null && opened.value?.id === "setup" && step.value === stepOf(kind);
});
effect(() => {
  if (link.value.phase === "open" && going.value) send({ type: "flow_show", on: shows.value });
});

/** The dot of the flow, where there is one. */
export const dot = computed(() => (scene.value && flow.value.kind ? (flow.value.dot ?? null) : null));
