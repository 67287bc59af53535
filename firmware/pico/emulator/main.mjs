// node main.mjs [-s SKIN_MEMORY] [-e SETTINGS] [-w WATCH] [-f] [-d] [-a] -p LINE IMAGE: the firmware, a UF2,
// on a simulated RP2040. LINE: descriptor of the master side of a pty, the serial port. What the switches
// must never do is said on stderr. -e: a file that the flash's last sector begins with. -f: while
// it scans, as fast as it goes and not in real time. -a: an ADS7042 is on SPI. -d: end when stdin does. On stdin: unplug, plug, stall, flow.
import { readFileSync, readSync, writeSync } from 'node:fs';
import { parseArgs } from 'node:util';

import { Chip } from './chip.mjs';
import { Front } from './front.mjs';
import { Skin } from './skin.mjs';
import { UsbHost } from './usb_host.mjs';
import { Watch } from './watch.mjs';

const SLICE_NS = 1_000_000;
const MOST_WAITING = 4096; // bytes that nobody reads: then the host takes no more
const LOST_MS = 50; // so far behind the wall clock, nothing is caught up
const WATCHED_MS = 20;
const SCANS_NS = 200_000_000; // after the last drive it no longer scans
const ID = Buffer.from('emulated');

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    line: { type: 'string', short: 'p' },
    skin: { type: 'string', short: 's' },
    settings: { type: 'string', short: 'e' },
    watch: { type: 'string', short: 'w' },
    fast: { type: 'boolean', short: 'f' },
    external: { type: 'boolean', short: 'a' },
    dependent: { type: 'boolean', short: 'd' },
  },
});

const line = Number(options.line);

function readUf2(path) {
  const data = readFileSync(path);
  const pages = new Map();
  for (let at = 0; at < data.length; at += 512) {
    pages.set(data.readUInt32LE(at + 12), data.subarray(at + 32, at + 32 + data.readUInt32LE(at + 16)));
  }
  return pages;
}

const pages = readUf2(positionals[0]);
const settings = options.settings === undefined ? Buffer.alloc(0) : readFileSync(options.settings);
const skin = new Skin(options.skin);
const watch = new Watch(options.watch);
let past = 0; // ns of the chips before this one
let busy = 0;
let board;
let rebooting = false;
const now = () => past + board.nanos;
const complain = (what) => process.stderr.write(`${Math.round(now())} ns: ${what}\n`);
const front = new Front(skin, watch, complain, options.external ?? false);
let host;
let out = Buffer.alloc(0);

function power(reason) {
  const made = new Chip({
    pages,
    settings,
    id: ID,
    reason,
    warn: (part, what) => complain(`${part}: ${what}`),
    onWatchdog: () => (rebooting = true),
  });
  past += board?.nanos ?? 0;
  busy += board?.busy ?? 0;
  board = made;
  front.attach(made.chip, now);
  host = new UsbHost(
    made.chip,
    (bytes) => (out = Buffer.concat([out, bytes])),
    (serial) => (watch.seen.serial = serial),
  );
}

function attempt(work) {
  try {
    return work();
  } catch (error) {
    if (error.code === 'EAGAIN') {
      return 0;
    }
    if (error.code === 'EIO') {
      process.exit(0); // the port is gone, and with it whoever started this
    }
    throw error;
  }
}

const read = Buffer.alloc(256);

function serve() {
  if (out.length > 0) {
    out = out.subarray(attempt(() => writeSync(line, out)));
  }
  host.stalled = watch.seen.stalled || out.length > MOST_WAITING;
  if (host.waiting === 0) {
    host.send(read.subarray(0, attempt(() => readSync(line, read, 0, read.length, null))));
  }
  host.look();
  skin.refresh();
}

let paced; // wall clock and simulated one, both in ms, when they last agreed
let watched = 0;

function behind() {
  const wall = performance.now();
  const simulated = now() / 1e6;
  if (paced === undefined || wall - paced.wall > simulated - paced.simulated + LOST_MS) {
    paced = { wall, simulated };
  }
  return simulated - paced.simulated - (wall - paced.wall);
}

function slice() {
  board.run(SLICE_NS, () => rebooting);
  if (rebooting) {
    rebooting = false;
    watch.seen.resets++;
    power(1);
  }
  serve();
  if (performance.now() - watched > WATCHED_MS) {
    watched = performance.now();
    watch.write(now(), front, busy + board.busy);
  }
  const free = options.fast && now() - front.opened < SCANS_NS;
  paced = free ? undefined : paced;
  const early = free ? 0 : behind();
  if (early > 1) {
    setTimeout(slice, early);
  } else {
    setImmediate(slice);
  }
}

const orders = {
  unplug: () => host.unplug(),
  plug: () => host.plug(),
  stall: () => (watch.seen.stalled = true),
  flow: () => (watch.seen.stalled = false),
};
if (options.dependent) {
  process.stdin.setEncoding('utf8');
  process.stdin.on('data', (text) => text.trim().split('\n').forEach((order) => orders[order]?.()));
  process.stdin.on('end', () => process.exit(0));
}
power(0);
process.stdout.write('ready\n');
slice();
