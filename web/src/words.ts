/** The state as a word, what someone must act on, and the figures of the top line. */

import type { Amount, Measurand } from "./decode";
import { duration, fixed } from "./format";

import type { LinkState } from "./socket";
import type { FlowNow, Scene, RunState } from "./wire";

export interface Warning {
  readonly text: string;
  /** The same without what counts up or down, for a screen reader. */
  readonly brief: string;
}

export interface Headline {
  /** The state in one or two words. */
  readonly word: string;
  /** What goes on, where nobody has to act on it; "" for nothing. */
  readonly remark: string;
  /** What someone must act on, the most urgent first. */
  readonly warnings: readonly Warning[];
}

/** An image older than this, s, while it should be moving, is reported as old. */
const OLD = 1.5;

const warning = (text: string, brief = text): Warning => ({ text, brief });
const calm = (word: string, remark = ""): Headline => ({ word, remark, warnings: [] });

function disconnected(link: LinkState & { phase: "lost" }, now: number, age: number | null): Headline {
  if (link.refused) {
    const text = "tomoskin was started again and does not know this page: open the address that it printed";
    return { word: "Disconnected", remark: "", warnings: [warning(text)] };
  }
  const wait = Math.max(0, link.retryAt / 1e3 - now);
  const retry = wait < 0.5 ? "trying again" : `trying again in ${duration(Math.ceil(wait))}`;
  const image = age === null ? "" : `, the image is ${duration(age)} old`;
  const text = `Connection lost${image}: ${retry}`;
  return { word: "Disconnected", remark: "", warnings: [warning(text, "Connection lost")] };
}

/** The state of a source that is connected. */
function stateOf(status: RunState, old: boolean): readonly [word: string, remark: string] {
  const { paused, reference, replay, running, recording } = status;
  if (replay?.ended) return ["At the end", ""];
  if (paused) return ["Paused", ""];
  if (!running) return ["Stopped", ""];
  if (!reference.ready) {
    return ["Taking reference", `${reference.frames} of ${reference.needed} frames: keep hands off`];
  }
  if (old) return ["No frames", ""];
  if (replay) return ["Playing", ""];
  return [recording ? "Recording" : "Live", ""];
}

/** What someone must act on; the server's own sentence first. */
function warningsOf(scene: Scene, status: RunState, age: number | null): Warning[] {
  const { baseline, calibration, paused, problem, replay, running, sick } = status;
  const found = problem ? [warning(problem)] : [];
  if (!running && !replay?.ended && !problem) found.push(warning("No frames come from the source"));
  if (running && !paused && !replay?.ended && age !== null && age > OLD) {
    found.push(warning(`No new image for ${duration(age)}`, "No new image"));
  }
  for (const { electrode, state, reason } of sick) {
    const name = `E${electrode + 1} is ${state}`;
    if (!problem?.includes(name)) found.push(warning(`${name}: ${reason}`));
  }
  if (calibration?.broken) {
    found.push(...calibration.findings.map((text) => warning(text, "The calibration does not fit any more")));
  }
  if (scene.same) found.push(warning(scene.same.text, "Two places look the same"));
  if (baseline?.stale) found.push(warning(`The reference is stale: ${baseline.stale}`));
  return found;
}

const TEACHING: Readonly<Record<string, string>> = { force: "forces", depth: "depths", mapping: "channels" };

/** A guided flow, in place of the calm word of a live skin; any other word stays. */
function withFlow(
  [word, remark]: readonly [word: string, remark: string],
  flow: FlowNow | null,
  live: boolean,
): readonly [word: string, remark: string] {
  if (!flow?.kind) return [word, remark];
  const name = TEACHING[flow.kind] ?? "touch";
  const count = flow.rubbed ? `${flow.rubbed.touches} touches` : `${flow.presses.length} recorded`;
  const said = flow.paused
    ? `Teaching ${name} is paused, ${count}: ${live ? "open Set up to go on or to leave it" : "go back to live to go on"}`
    : `Teaching ${name}: ${count}`;
  if (word !== "Live") return [word, remark || said];
  return [flow.paused ? "Teaching paused" : `Teaching ${name}`, said];
}

/** What the top line says. `age`: seconds since the last frame, null before the first; `opening`:
 * the recording that is about to be played. */
export function headline(
  link: LinkState,
  scene: Scene | null,
  status: RunState | null,
  now: number,
  age: number | null,
  flow: FlowNow | null = null,
  opening: string | null = null,
): Headline {
  if (link.phase === "lost") return disconnected(link, now, age);
  if (link.phase === "connecting" || !scene || !status) return calm("Connecting");
  if (opening !== null) return { ...calm("Opening", opening), warnings: warningsOf(scene, status, age) };
  const [word, remark] = withFlow(stateOf(status, age !== null && age > OLD), flow, !status.replay);
  return { word, remark, warnings: warningsOf(scene, status, age) };
}

export interface Fact {
  readonly name: string;
  readonly value: string;
  readonly id: string;
  /** Said in full, for a tooltip. */
  readonly title: string;
}

/** The figures of the top line. */
export function facts(status: RunState | null): Fact[] {
  if (!status) return [];
  const lost = status.dropped + status.corrupt + status.gaps;
  const { age_s: age } = status.reference;
  const excluded = {
    id: "excluded",
    name: "excluded",
    value: String(status.left_out),
    title: "Measurements that the image does without",
  };
  const troubled = {
    id: "troubled",
    name: "troubled",
    value: String(status.late + status.deaf),
    title: `Frames with trouble on the board: ${status.late} with samples read late, ${status.deaf} in which it lost bytes from the host`,
  };
  return [
    ...(status.left_out > 0 ? [excluded] : []),
    ...(status.late + status.deaf > 0 ? [troubled] : []),
    { id: "fps", name: "frames/s", value: fixed(status.fps, 0), title: "Frames decoded per second" },
    {
      id: "dropped",
      name: "lost",
      value: String(lost),
      title: `Frames lost: ${status.dropped} dropped, ${status.corrupt} corrupt, ${status.gaps} gaps`,
    },
    {
      id: "latency",
      name: "ms delay",
      value: fixed(status.p99_ms, 1),
      title: `From bytes to touches: 99 of 100 frames take less; median ${fixed(status.p50_ms, 2)} ms`,
    },
    {
      id: "reference",
      name: "reference",
      value: age === null ? "–" : duration(age),
      title: "Time since the reference was taken",
    },
  ];
}

/** Alpha of the images and what chose it. */
export function alpha(status: RunState): string {
  const by = status.rule === "hand" ? "by hand" : status.rule;
  return `${Number(status.alpha.toPrecision(2))} (${by})`;
}

/** The same in full, for a tooltip. */
export function alphaInFull(status: RunState): string {
  const by = status.rule === "hand" ? "set by hand" : `chosen by the rule ${status.rule}`;
  return `Weight of the prior, ${status.alpha.toPrecision(4)}, ${by}`;
}

/** How each is shown: in a unit, so many to one of SI, with its decimals; and what its axis ends with,
 * SI, where the calibration does not say what it reaches. */
export const MEASURANDS = {
  force: { title: "Force", felt: "felt, N", unit: "N", words: "newtons", perUnit: 1, decimals: 1, usual: 10 },
  depth: { title: "Depth", felt: "deep, mm", unit: "mm", words: "millimetres deep", perUnit: 1e3, decimals: 2, usual: 5e-3 },
} as const;
/** An amount with its interval, in words. */
export function amountInWords({ value, low, high }: Amount, name: Measurand): string {
  const { perUnit, decimals, words } = MEASURANDS[name];
  const told = (one: number) => fixed(perUnit * one, decimals);
  if (high === Infinity) return `more than ${told(low)} ${words}, beyond what was taught`;
  return `${told(value)} ${words}, ${told(low)} to ${told(high)}`;
}
