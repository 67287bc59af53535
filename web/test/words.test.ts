import { describe, expect, it } from "vitest";
import type { Scene, Status } from "../src/protocol";
import { backOff, socketAddress } from "../src/socket";
import { alpha, alphaInFull, facts, sentence, stateInWords } from "../src/words";

const scene = { source: "twin of textile-disc-8" } as Scene;
const status: Status = {
  type: "state",
  running: true,
  paused: false,
  fps: 124.6,
  dropped: 1,
  corrupt: 2,
  gaps: 3,
  p50_ms: 0.3,
  p99_ms: 0.8,
  stages: [],
  reference: { frames: 20, needed: 20, age_s: 75, ready: true },
  baseline: null,
  sick: [],
  replay: null,
  state: null,
  noise_v: 1e-5,
  alpha: 0.0509,
  rule: "light-touch",
  left_out: 0,
  recording: null,
  problem: null,
  text: "",
};
const open = { phase: "open" } as const;

describe("the sentence", () => {
  it("is calm while all is well", () => {
    expect(sentence(open, scene, status, 10, 0.1)).toMatchObject({ text: "Live", act: false });
    expect(sentence(open, scene, { ...status, paused: true }, 10, 60).act).toBe(false);
    const recording = { ...status, recording: "run.mcap" };
    expect(sentence(open, scene, recording, 10, 0.1).text).toBe("Live, recording");
    expect(sentence({ phase: "connecting" }, null, null, 0, null).text).toBe("Connecting");
  });

  it("counts the reference", () => {
    const reference = { ...status.reference, frames: 7, ready: false };
    expect(sentence(open, scene, { ...status, reference }, 0, 0).text).toContain("7 of 20: keep hands off");
  });

  it("asks for action on problems, old pictures and a lost connection", () => {
    const problem = { ...status, problem: "electrode 5 is open" };
    expect(sentence(open, scene, problem, 0, 0)).toMatchObject({ text: "electrode 5 is open", act: true });
    expect(sentence(open, scene, status, 9, 4).text).toBe("No new picture for 4 s");
    const lost = { phase: "lost", since: 0, retryAt: 12_000, refused: false } as const;
    expect(sentence(lost, scene, status, 9, 4)).toEqual({
      text: "Connection lost, the picture is 4 s old: trying again in 3 s",
      brief: "Connection lost",
      act: true,
    });
    expect(sentence({ ...lost, refused: true }, scene, status, 9, 4).text).toContain("open the address");
  });
});

it("adds up what was lost and says what it was", () => {
  const lost = facts(status).find(({ id }) => id === "dropped");
  expect(lost).toMatchObject({ value: "6", title: "1 dropped, 2 corrupt, 3 gaps" });
  expect(facts(null)).toEqual([]);
});

it("says alpha and what chose it", () => {
  expect(alpha(status)).toBe("alpha 0.051 (light-touch)");
  expect(alphaInFull(status)).toBe("Weight of the prior, 0.05090, chosen by the rule light-touch");
  const byHand = { ...status, alpha: 0.1, rule: "hand" };
  expect(alpha(byHand)).toBe("alpha 0.1 (by hand)");
  expect(alphaInFull(byHand)).toContain("set by hand");
});

it("waits longer after each failed try, up to a bound", () => {
  expect([0, 1, 2, 9].map(backOff)).toEqual([500, 1000, 2000, 8000]);
});

it("finds the socket beside the page and leaves the token out", () => {
  expect(socketAddress({ href: "http://127.0.0.1:8765/?token=a" })).toBe("ws://127.0.0.1:8765/ws");
  expect(socketAddress({ href: "https://lab:1/x/" })).toBe("wss://lab:1/x/ws");
});

describe("the state that the sheet is in", () => {
  it("is named with its probability", () => {
    expect(stateInWords({ name: "bend", probability: 0.974, unknown: false })).toBe("State: bend, 97 %");
  });

  it("is said to be unknown where it is none that was learnt", () => {
    expect(stateInWords({ name: "bend", probability: 1, unknown: true })).toMatch(
      /^State unknown \(nearest: bend\)$/,
    );
  });
});
