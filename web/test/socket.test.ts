import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Connection, type LinkState } from "../src/socket";

/** A socket that does nothing by itself. */
class Silent {
  static readonly OPEN = 1;
  static made: Silent[] = [];
  readyState = 0;
  binaryType = "";
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: (() => void) | null = null;

  constructor(readonly address: string) {
    Silent.made.push(this);
  }

  opens(): void {
    this.readyState = 1;
    this.onopen?.();
  }

  close(): void {
    this.readyState = 3;
    this.onclose?.();
  }
}

function connected(): { connection: Connection<object>; states: LinkState[] } {
  const states: LinkState[] = [];
  const listener = { message: vi.fn(), frame: vi.fn(), link: (state: LinkState) => states.push(state) };
  const connection = new Connection<object>("ws://127.0.0.1/ws", listener);
  connection.open();
  return { connection, states };
}

beforeEach(() => {
  vi.useFakeTimers();
  Silent.made = [];
  vi.stubGlobal("window", globalThis);
  vi.stubGlobal("WebSocket", Silent);
  vi.stubGlobal("fetch", () => Promise.reject(new Error("no server")));
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

describe("a connection", () => {
  it("that does not open is lost, and tried again", async () => {
    const { states } = connected();
    await vi.advanceTimersByTimeAsync(9_900);
    expect(states).toEqual([]);
    await vi.advanceTimersByTimeAsync(200);
    expect(states.at(-1)).toMatchObject({ phase: "lost", refused: false });
    await vi.advanceTimersByTimeAsync(500);
    expect(Silent.made).toHaveLength(2);
    Silent.made[1].opens();
    expect(states.at(-1)).toEqual({ phase: "open" });
  });

  it("that has opened stays", async () => {
    const { states } = connected();
    Silent.made[0].opens();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(states).toEqual([{ phase: "open" }]);
    expect(Silent.made).toHaveLength(1);
  });
});
