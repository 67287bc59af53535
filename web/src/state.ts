/** Everything that the page knows, as signals; the newest frame beside them, outside rendering. */

import { batch, computed, signal } from "@preact/signals";
import { decodeFrame, type Frame } from "./decode";
import { History } from "./history";
import { emptyHand, type Hand } from "./presses";
import { prepareTopology } from "./sheet/topology";
import { Connection, type LinkState, socketAddress } from "./socket";
import type { PageRequest, Scene, ServerMessage, RunState } from "./wire";

export const scene = signal<Scene | null>(null);
export const status = signal<RunState | null>(null);
export const link = signal<LinkState>({ phase: "connecting" });
/** A sentence that the server just said, cleared after some seconds. */
export const notice = signal<string | null>(null);
/** Whether it answers what was just done here: then it is shown before anything else. */
export const answered = signal(false);

/** How the page shows things; nothing of it leaves the page. */
export const smoothed = signal(true);
export const showTruth = signal(false);
export const showDifference = signal(false);
/** Set by "Fit colours"; null: the scene's own fixed limit. */
export const ownLimit = signal<number | null>(null);
export const keepPresses = signal(false);

export const limit = computed(() => ownLimit.value ?? scene.value?.limit ?? 1);
const points = computed(() => scene.value?.points);
const cells = computed(() => scene.value?.cells);
/** Made anew for another mesh only. */
export const topology = computed(() =>
  points.value && cells.value ? prepareTopology(points.value, cells.value) : null,
);

export const hand = signal<Hand>(emptyHand({ radius: 0.01, force: 1, maxForce: 10 }));

/** The newest frame as shown in numbers: ten times a second. */
export const shown = signal<Frame | null>(null);
/** Page time, s, at the same rhythm; for ages. */
export const now = signal(0);

/** The newest frame and when it came, written at the wire's pace, read at the display's. */
export const newest = { frame: null as Frame | null, arrived: 0, count: 0, broken: 0 };
export const history = new History();

/** Called when a new frame (or nothing but its setting) wants painting. */
let repaint = (): void => undefined;
export function onRepaint(callback: () => void): void {
  repaint = callback;
}
export const requestRepaint = (): void => repaint();

const NOTICE_SECONDS = 6;
let noticeTimer = 0;

/** Show a sentence in the line of state for some seconds; an ``answer`` is not lost behind others. */
export function say(text: string, answer = true): void {
  if (!answer && answered.peek()) return;
  window.clearTimeout(noticeTimer);
  batch(() => {
    notice.value = text;
    answered.value = answer;
  });
  const clear = () => batch(() => ((notice.value = null), (answered.value = false)));
  noticeTimer = window.setTimeout(clear, NOTICE_SECONDS * 1e3);
}

function setScene(next: Scene): void {
  const last = scene.value;
  const changed = !last || String(next.cells) !== String(last.cells) || next.source !== last.source;
  const { radius_m: radius, force_n: force, max_force_n: maxForce } = next.probe;
  batch(() => {
    scene.value = next;
    if (changed) {
      hand.value = emptyHand({ radius, force, maxForce });
      ownLimit.value = null;
      newest.frame = null;
      shown.value = null;
      history.clear();
    }
  });
}

const receivers = new Map<string, ((message: ServerMessage) => void)[]>();

/** Call back with every message of that type, in the order in which callers asked. */
export function onMessage<T extends ServerMessage["type"]>(
  type: T,
  receive: (message: Extract<ServerMessage, { readonly type: T }>) => void,
): void {
  receivers.set(type, [...(receivers.get(type) ?? []), receive as (message: ServerMessage) => void]);
}

function receive(message: ServerMessage): void {
  for (const receiver of receivers.get(message.type) ?? []) receiver(message);
}

onMessage("scene", setScene);
onMessage("scale", ({ limit, unit }) => {
  if (scene.value) scene.value = { ...scene.value, limit, unit };
});
onMessage("state", (message) => (status.value = message));
onMessage("event", ({ text }) => say(text, false));
onMessage("error", ({ message }) => say(message));

const frameReceivers: ((frame: Frame) => void)[] = [];

/** Call back with every frame, at the wire's pace: little work only. */
export const onFrame = (receive: (frame: Frame) => void): void => void frameReceivers.push(receive);

/** A frame that does not fit the scene (it crossed a change of skin) is not shown. */
function receiveFrame(bytes: ArrayBuffer): void {
  let frame: Frame;
  try {
    frame = decodeFrame(bytes);
  } catch {
    newest.broken++;
    return;
  }
  if (frame.image.length !== topology.peek()?.nCells) return;
  if (frame.voltages.length !== scene.peek()?.pattern.n_meas) return;
  newest.frame = frame;
  newest.arrived = performance.now() / 1e3;
  newest.count++;
  history.add(frame.hostTime, frame.touches);
  for (const receive of frameReceivers) receive(frame);
  repaint();
}

/** Scripting time spent on frames, for the bench: arrival, painting, numbers. */
export const cost = { seconds: 0 };

/** Run and add the time to the cost. */
export function timed<A extends unknown[]>(work: (...args: A) => void): (...args: A) => void {
  return (...args) => {
    const start = performance.now();
    work(...args);
    cost.seconds += (performance.now() - start) / 1e3;
  };
}

export const connection = new Connection<ServerMessage>(socketAddress(window.location), {
  message: receive,
  frame: timed(receiveFrame),
  link(state) {
    // The server lifts our presses when it loses us; so does the page.
    if (state.phase === "lost") hand.value = { ...hand.peek(), held: [] };
    link.value = state;
  },
});

/** Send a request to the server. */
export const send = (message: PageRequest): void => connection.send(message);

const TICK_MS = 100;

/** Open the connection and start the ten-a-second rhythm of the numbers. */
export function start(): void {
  connection.open();
  const tick = timed(() => {
    history.trim();
    batch(() => {
      now.value = performance.now() / 1e3;
      shown.value = newest.frame;
    });
  });
  window.setInterval(tick, TICK_MS);
}
