import { describe, expect, it } from "vitest";
import type { FlowNow, Scene, RunState } from "../src/wire";
import { backOff, socketAddress } from "../src/socket";
import { alpha, alphaInFull, facts, headline } from "../src/words";

const scene = { source: "twin of textile-disc-8" } as Scene;
const status: RunState = {
  type: "state",
  running: true,
  paused: false,
  fps: 124.6,
  frames: 900,
  sinks: [],
  dropped: 1,
  corrupt: 2,
  gaps: 3,
  late: 0,
  deaf: 0,
  p50_ms: 0.3,
  p99_ms: 0.8,
  stages: [],
  slowest: [],
  reference: { frames: 20, needed: 20, age_s: 75, ready: true },
  baseline: null,
  sick: [],
  replay: null,
  calibration: null,
  noise_v: 1e-5,
  alpha: 0.0509,
  rule: "light-touch",
  left_out: 0,
  recording: null,
  problem: null,
  text: "",
};
const open = { phase: "open" } as const;

const words = (...[next, age]: readonly [Partial<RunState>, (number | null)?]) =>
  headline(open, scene, { ...status, ...next }, 10, age ?? 0.1);
const texts = (next: Partial<RunState>, age?: number) => words(next, age).warnings.map(({ text }) => text);

describe("the headline", () => {
  it("is one calm word while all is well", () => {
    expect(words({})).toEqual({ word: "Live", remark: "", warnings: [] });
    expect(words({ paused: true }, 60)).toMatchObject({ word: "Paused", warnings: [] });
    expect(words({ recording: "run.mcap" }).word).toBe("Recording");
    expect(headline({ phase: "connecting" }, null, null, 0, null).word).toBe("Connecting");
  });

  it("warns of places that the pattern cannot tell apart", () => {
    const same = { text: "a press looks the same across", maps: [[-1, 0, 0, -1, 0, 0]], least_m: 0.02 };
    const line = headline(open, { ...scene, same }, status, 10, 0.1);
    expect(line.warnings.map(({ text }) => text)).toEqual(["a press looks the same across"]);
  });

  it("says that a recording is opened, until it is", () => {
    const line = headline(open, scene, status, 10, 0.1, null, "run.mcap");
    expect(line).toEqual({ word: "Opening", remark: "run.mcap", warnings: [] });
  });

  it("names a guided flow, and says when it is paused", () => {
    const flow = { kind: "force", paused: false, presses: [[0, 0]], rubbed: null } as unknown as FlowNow;
    const line = (next: Partial<RunState>, given: FlowNow) =>
      headline(open, scene, { ...status, ...next }, 10, 0.1, given);
    expect(line({}, flow)).toMatchObject({ word: "Teaching forces", remark: "Teaching forces: 1 recorded" });
    expect(line({}, { ...flow, paused: true })).toMatchObject({ word: "Teaching paused" });
    expect(line({}, { ...flow, paused: true }).remark).toContain("open Set up");
    expect(line({ recording: "run.mcap" }, flow)).toMatchObject({ word: "Recording", remark: "Teaching forces: 1 recorded" });
    const replay = { now_s: 0, end_s: 9, ended: false, speed: 1, loop: false };
    expect(line({ replay }, { ...flow, paused: true })).toMatchObject({
      word: "Playing",
      remark: "Teaching forces is paused, 1 recorded: go back to live to go on",
    });
    expect(line({}, { ...flow, kind: null })).toMatchObject({ word: "Live", remark: "" });
  });

  it("says what a calibration says that does not fit any more", () => {
    const calibration = { well: false, broken: false, findings: ["1.7 times worse"] };
    expect(texts({ calibration })).toEqual([]);
    const other = { well: false, broken: true, findings: ["2 rows have jumped"] };
    expect(words({ calibration: other }).warnings).toEqual([
      { text: "2 rows have jumped", brief: "The calibration does not fit any more" },
    ]);
  });

  it("counts the reference", () => {
    const reference = { ...status.reference, frames: 7, ready: false };
    expect(words({ reference })).toMatchObject({ remark: "7 of 20 frames: keep hands off", warnings: [] });
  });

  it("says of a replay whether it plays or has ended", () => {
    const replay = { now_s: 4, end_s: 4, speed: 1, loop: false, ended: true };
    expect(words({ replay: { ...replay, ended: false } }).word).toBe("Playing");
    expect(words({ replay, running: false }, 60)).toEqual({ word: "At the end", remark: "", warnings: [] });
  });

  it("warns of each thing once, the server's own sentence first", () => {
    const sick = [
      { electrode: 4, state: "open", reason: "no current flows", since: 1 },
      { electrode: 6, state: "noisy", reason: "ten times its noise", since: 1 },
    ];
    expect(texts({ problem: "E5 is open: no current flows", sick })).toEqual([
      "E5 is open: no current flows",
      "E7 is noisy: ten times its noise",
    ]);
    const baseline = { drift: 0.1, held_s: 0, noise_v: null, stale: "drift of 10 %" };
    expect(texts({ baseline })).toEqual(["The reference is stale: drift of 10 %"]);
    expect(texts({ running: false })).toEqual(["No frames come from the source"]);
    expect(texts({}, 4)).toEqual(["No new image for 4 s"]);
  });

  it("says how long a lost connection takes, and to a screen reader that it is lost", () => {
    const lost = { phase: "lost", since: 0, retryAt: 12_000, refused: false } as const;
    expect(headline(lost, scene, status, 9, 4).warnings).toEqual([
      { text: "Connection lost, the image is 4 s old: trying again in 3 s", brief: "Connection lost" },
    ]);
    const refused = headline({ ...lost, refused: true }, scene, status, 9, 4);
    expect(refused.warnings[0].text).toContain("open the address");
  });
});

it("adds up what was lost and says what it was", () => {
  const lost = facts(status).find(({ id }) => id === "dropped");
  expect(lost).toMatchObject({ value: "6", title: "Frames lost: 1 dropped, 2 corrupt, 3 gaps" });
  expect(facts(null)).toEqual([]);
  expect(facts(status).some(({ id }) => id === "troubled")).toBe(false);
  const troubled = facts({ ...status, late: 2, deaf: 1 }).find(({ id }) => id === "troubled");
  expect(troubled).toMatchObject({ value: "3", title: expect.stringContaining("2 with samples read late, 1 in which") });
});

it("says alpha and what chose it", () => {
  expect(alpha(status)).toBe("0.051 (light-touch)");
  expect(alphaInFull(status)).toBe("Weight of the prior, 0.05090, chosen by the rule light-touch");
  const byHand = { ...status, alpha: 0.1, rule: "hand" };
  expect(alpha(byHand)).toBe("0.1 (by hand)");
  expect(alphaInFull(byHand)).toContain("set by hand");
});

it("waits longer after each failed try, up to a bound", () => {
  expect([0, 1, 2, 9].map(backOff)).toEqual([500, 1000, 2000, 8000]);
});

it("finds the socket beside the page and leaves the token out", () => {
  expect(socketAddress({ href: "http://127.0.0.1:8765/?token=a" })).toBe("ws://127.0.0.1:8765/ws");
  expect(socketAddress({ href: "https://lab:1/x/" })).toBe("wss://lab:1/x/ws");
});
