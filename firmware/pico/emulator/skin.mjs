// The skin before the converter: the memory that the host's side writes (firmware/host/skin.h).
import { openSync, readSync } from 'node:fs';

const MOST = 32;
const MAGIC = 0x31306e696b736f74n;
const HEAD = 72;
const FAULTS = HEAD + 8 * MOST * MOST; // those of a Mega's board, and:
const READING = FAULTS + 4 * 4 + 2 * MOST; // 1 + the channel that is read instead; 0: its own
const POTENTIALS = READING + MOST;
const OFFSETS = POTENTIALS + 8 * MOST; // of the channels' amplifiers
const DOUBLE_LAYER = OFFSETS + 8 * MOST;
const LEAK = DOUBLE_LAYER + 8;
const SIZE = LEAK + 8;

export class Skin {
  /** The skin in the file at `path`; without one, each electrode at the end of 1 + e ohm. */
  constructor(path) {
    this.view = new DataView(new ArrayBuffer(SIZE));
    this.state = 88172645;
    this.layer = new Float64Array(MOST); // V of the double layers
    this.file = path === undefined ? undefined : openSync(path, 'r');
    if (this.file === undefined) {
      this.#star();
    } else if (!this.refresh()) {
      throw new Error(`skin memory ${path}: is no skin memory of this version`);
    }
  }

  /** Take over what has been written since; not what is being written. False: no skin memory. */
  refresh() {
    if (this.file === undefined) {
      return true;
    }
    const fresh = new DataView(new ArrayBuffer(SIZE));
    const again = new Uint8Array(4);
    const size = readSync(this.file, new Uint8Array(fresh.buffer), 0, SIZE, 0);
    readSync(this.file, again, 0, 4, 8);
    if (size !== SIZE || fresh.getBigUint64(0, true) !== MAGIC) {
      return false;
    }
    const sequence = fresh.getUint32(8, true);
    if (sequence % 2 === 0 && sequence === new DataView(again.buffer).getUint32(0, true)) {
      this.view = fresh;
    }
    return true;
  }

  /** One conversion; -1 for a source, sink or channel that is none. */
  code(source, sink, addressed) {
    const channel = (this.view.getUint8(READING + addressed) || addressed + 1) - 1;
    const [gain, offset, reference, levels, noise] = [2, 3, 4, 5, 6].map((k) => this.#figure(k));
    const input = this.#volts(source, sink, channel) + this.view.getFloat64(OFFSETS + 8 * addressed, true);
    const volts = gain * input + offset;
    const exact = (volts * levels) / reference + (noise > 0 ? noise * this.#chance() : 0);
    return Math.min(Math.max(Math.floor(exact), 0), levels - 1);
  }

  /** The current has flowed for so many ns, and has charged the double layers, which leak. */
  pass(source, sink, nanos) {
    const farads = this.view.getFloat64(DOUBLE_LAYER, true);
    if (farads <= 0) {
      return;
    }
    const leak = this.view.getFloat64(LEAK, true);
    const limit = source >= 0 && sink >= 0 ? this.#figure(0) * leak : 0;
    const kept = Math.exp(-nanos / 1e9 / (farads * leak));
    this.layer.forEach((volts, e) => {
      const end = e === source ? limit : e === sink ? -limit : 0;
      this.layer[e] = end + (volts - end) * kept;
    });
  }

  #figure(number) {
    return this.view.getFloat64(16 + 8 * number, true);
  }

  /** V that an electrode has by itself. */
  #own(electrode) {
    return this.view.getFloat64(POTENTIALS + 8 * electrode, true) + this.layer[electrode];
  }

  #resistance(row, column) {
    const n = this.view.getUint32(12, true);
    return this.view.getFloat64(HEAD + 8 * (row * n + column), true);
  }

  /** V of a channel against the sink; 0 beyond the electrodes or with nothing connected. */
  #volts(source, sink, channel) {
    const n = this.view.getUint32(12, true);
    if (source < 0 || sink < 0 || source >= n || sink >= n || channel >= n) {
      return 0;
    }
    const r = (row, column) => this.#resistance(row, column);
    const atSink = r(source, sink) - r(sink, sink);
    const load = r(source, source) - r(sink, source) - atSink;
    const amperes = Math.min(this.#figure(0), load > 0 ? this.#figure(1) / load : Infinity);
    const own = this.#own(channel) - this.#own(sink);
    return amperes * (r(source, channel) - r(sink, channel) - atSink) + own;
  }

  /** Nearly normal: twelve uniform numbers (Irwin and Hall), always the same ones. */
  #chance() {
    let sum = -6;
    for (let k = 0; k < 12; k++) {
      this.state ^= this.state << 13;
      this.state ^= this.state >>> 17;
      this.state ^= this.state << 5;
      sum += (this.state >>> 0) / 2 ** 32;
    }
    return sum;
  }

  #star() {
    const figures = [0.1, 1e9, 1, 0, 3.3, 4096, 0];
    figures.forEach((value, k) => this.view.setFloat64(16 + 8 * k, value, true));
    this.view.setUint32(12, MOST, true);
    for (let e = 0; e < MOST; e++) {
      this.view.setFloat64(HEAD + 8 * (e * MOST + e), 1 + e, true);
    }
  }
}
