// What is seen of the board, in a file that a test reads: tests/emulator/pico.py.
import { renameSync, writeFileSync } from 'node:fs';

export class Watch {
  /** Written to `path`; undefined: nothing is kept. */
  constructor(path) {
    this.path = path;
    this.seen = { longestOn: 0, shortestOff: null, resets: 0, drives: 0, serial: '', stalled: false };
    this.instants = new Map();
    this.net = new Array(32).fill(0); // of pairs, by the lower channel: ns from the other one to it
  }

  began(off) {
    this.seen.drives++;
    const before = this.seen.shortestOff;
    if (Number.isFinite(off) && (before === null || off < before)) {
      this.seen.shortestOff = off;
    }
  }

  /** A drive ends that was on for so many ns. */
  ended(on, source, sink) {
    this.seen.longestOn = Math.max(this.seen.longestOn, on);
    if (source >= 0 && sink >= 0) {
      this.net[Math.min(source, sink)] += source > sink ? on : -on;
    }
  }

  /** A conversion that `begun` so many ns into its drive is fetched for `channel`, when `left`, with
      it, are to come. Unsettled: the last one that was of another channel. */
  fetched({ source, sink, channel: begun, after }, channel, left) {
    if (this.path === undefined || source < 0) {
      return;
    }
    if (begun !== channel && !(this.seen.unsettled <= left)) {
      this.seen.unsettled = left;
    }
    const key = ((source * 32 + sink) * 32 + channel) * 256 + left;
    const span = this.instants.get(key);
    if (span === undefined) {
      this.instants.set(key, [after, after]);
    } else if (after < span[0]) {
      span[0] = after;
    } else if (after > span[1]) {
      span[1] = after;
    }
  }

  /** How far the instant of one and the same conversion has moved, ns. */
  get jitter() {
    let most = 0;
    for (const [first, last] of this.instants.values()) {
      most = Math.max(most, last - first);
    }
    return most;
  }

  write(now, front, busy) {
    if (this.path === undefined) {
      return;
    }
    const connected = front.source >= 0 || front.sink >= 0;
    const on = connected ? now - front.since : 0;
    const { net, jitter } = this;
    const seen = { ...this.seen, now, busy, connected, jitter, net };
    seen.longestOn = Math.max(seen.longestOn, on);
    seen.instants = this.instants.size;
    writeFileSync(`${this.path}.new`, JSON.stringify(seen));
    renameSync(`${this.path}.new`, this.path);
  }
}
