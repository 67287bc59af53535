/** The state in one sentence, and whether someone must act. */

import { duration, fixed } from "./format";
import type { Scene, StateReading, Status } from "./protocol";
import type { LinkState } from "./socket";

export interface Sentence {
  readonly text: string;
  /** The same without what counts up or down, for a screen reader. */
  readonly brief: string;
  /** Amber: someone must act. */
  readonly act: boolean;
}

/** A picture older than this, while it should be moving, is said to be old. */
const OLD = 1.5;

const calm = (text: string, brief = text): Sentence => ({ text, brief, act: false });
const act = (text: string, brief = text): Sentence => ({ text, brief, act: true });

function lostSentence(link: LinkState & { phase: "lost" }, now: number, age: number | null): Sentence {
  if (link.refused) {
    return act("tomoskin was started again and does not know this page: open the address that it printed");
  }
  const wait = Math.max(0, link.retryAt / 1e3 - now);
  const retry = wait < 0.5 ? "trying again" : `trying again in ${duration(Math.ceil(wait))}`;
  const picture = age === null ? "" : `, the picture is ${duration(age)} old`;
  return act(`Connection lost${picture}: ${retry}`, "Connection lost");
}

/** What the top line says. `age`: seconds since the last frame, null before the first. */
export function sentence(
  link: LinkState,
  scene: Scene | null,
  status: Status | null,
  now: number,
  age: number | null,
): Sentence {
  if (link.phase === "lost") return lostSentence(link, now, age);
  if (link.phase === "connecting" || !scene) return calm("Connecting");
  if (status?.problem) return act(status.problem);
  if (status?.paused) return calm("Paused");
  if (status && !status.reference.ready) {
    const { frames, needed } = status.reference;
    return calm(
      `Taking the reference, ${frames} of ${needed}: keep hands off`,
      "Taking the reference: keep hands off",
    );
  }
  if (status && !status.running) return act("Stopped: no frames come from the source");
  if (age !== null && age > OLD) return act(`No new picture for ${duration(age)}`, "No new picture");
  return calm(status?.recording ? "Live, recording" : "Live");
}

export interface Fact {
  readonly name: string;
  readonly value: string;
  readonly id: string;
  /** Said in full, for a tooltip. */
  readonly title: string;
}

/** The figures of the top line. */
export function facts(status: Status | null): Fact[] {
  if (!status) return [];
  const lost = status.dropped + status.corrupt + status.gaps;
  const { age_s: age } = status.reference;
  const leftOut = {
    id: "left-out",
    name: "rows left out",
    value: String(status.left_out),
    title: "Measurements that the picture does without",
  };
  return [
    ...(status.left_out > 0 ? [leftOut] : []),
    { id: "fps", name: "frames/s", value: fixed(status.fps, 0), title: "Frames decoded per second" },
    {
      id: "dropped",
      name: "lost",
      value: String(lost),
      title: `${status.dropped} dropped, ${status.corrupt} corrupt, ${status.gaps} gaps`,
    },
    {
      id: "latency",
      name: "ms p99",
      value: fixed(status.p99_ms, 2),
      title: `Bytes in to touches out: median ${fixed(status.p50_ms, 2)} ms`,
    },
    {
      id: "reference",
      name: "reference",
      value: age === null ? "–" : duration(age),
      title: "Age of the reference",
    },
  ];
}

/** Alpha of the pictures and what chose it. */
export function alpha(status: Status): string {
  const by = status.rule === "hand" ? "by hand" : status.rule;
  return `alpha ${Number(status.alpha.toPrecision(2))} (${by})`;
}

/** The same in full, for a tooltip. */
export function alphaInFull(status: Status): string {
  const by = status.rule === "hand" ? "set by hand" : `chosen by the rule ${status.rule}`;
  return `Weight of the prior, ${status.alpha.toPrecision(4)}, ${by}`;
}

/** Which of the states that were learnt the sheet is in. */
export function stateInWords({ name, probability, unknown }: StateReading): string {
  if (unknown) return `State unknown (nearest: ${name})`;
  return `State: ${name}, ${fixed(100 * probability, 0)} %`;
}
