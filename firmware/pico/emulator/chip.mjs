// The chip and its flash: rp2040js, and the parts of the RP2040 that it leaves out.
import { RP2040 } from 'rp2040js';

const FLASH = 0x10000000;
const SECTOR = 0x1000;
const FLASH_SIZE = 0x200000;
const NS_PER_CYCLE = 8;
const ENTRY_CYCLES = 15; // of an exception, which rp2040js gives for nothing
const RETURN_CYCLES = 10;
const POWER_ON = 1 << 8;
const UNIQUE_ID = 0x4b;
const ID_AT = 5;

/** A part of the chip with registers that are only kept, but for those of `get` and `set`. */
class Registers {
  constructor(get = {}, set = {}) {
    this.held = new Map();
    this.get = get;
    this.set = set;
  }

  readUint32(offset) {
    return this.get[offset] ? this.get[offset]() : (this.held.get(offset) ?? 0);
  }

  writeUint32Atomic(offset, value, type) {
    const before = this.held.get(offset) ?? 0;
    const after = [value, before ^ value, before | value, before & ~value][type] >>> 0;
    this.held.set(offset, after);
    this.set[offset]?.(after);
  }
}

/** The flash by its serial interface: it knows its number. */
function flashPorts(id) {
  let sent = [];
  let answers = [];
  let selected = false;
  const ssi = new Registers(
    { 0x24: () => answers.length, 0x60: () => answers.shift() ?? 0 },
    {
      0x60: (byte) => {
        sent.push(byte);
        const asked = selected && sent[0] === UNIQUE_ID && sent.length > ID_AT;
        answers.push(asked ? id[sent.length - 1 - ID_AT] : 0);
      },
    },
  );
  const pins = new Registers(
    {},
    {
      0x0c: (control) => {
        selected = ((control >> 8) & 3) === 2;
        sent = selected ? [] : sent;
      },
    },
  );
  return { ssi, pins };
}

export class Chip {
  /** `pages` of the flash by address; `settings`: its last sector; `reason`: of the watchdog. */
  constructor({ pages, settings, id, reason, warn, onWatchdog }) {
    const chip = new RP2040();
    this.chip = chip;
    this.extra = 0;
    this.busy = 0;
    chip.logger = { debug() {}, info() {}, warn, error: warn };
    for (const [address, bytes] of pages) {
      chip.flash.set(bytes, address - FLASH);
    }
    chip.flash.set(settings, FLASH_SIZE - SECTOR);
    const { ssi, pins } = flashPorts(id);
    chip.peripherals[0x18000] = ssi;
    chip.peripherals[0x40018] = pins;
    chip.peripherals[0x40064] = new Registers({ 8: () => POWER_ON });
    const watchdog = chip.peripherals[0x40058];
    watchdog.reason = reason;
    watchdog.onWatchdogTrigger = () => {
      watchdog.timer.enable = false; // else rp2040js calls for ever
      onWatchdog();
    };
    this.#wakeLocked();
    this.#countExceptions();
    chip.core.PC = FLASH; // as the boot ROM does, once it has checked the second stage
  }

  get nanos() {
    return this.chip.clock.nanos;
  }

  /** Run for `nanos`, or until `stopped()`. */
  run(nanos, stopped) {
    const { core, clock } = this.chip;
    const end = clock.nanos + nanos;
    while (clock.nanos < end && !stopped()) {
      if (core.waiting && this.#pending) {
        core.waiting = false; // it came before the instruction that waits: rp2040js sleeps on
      }
      if (core.waiting) {
        clock.tick(Math.min(clock.nanosToNextAlarm || Infinity, end - clock.nanos));
        continue;
      }
      const spent = (core.executeInstruction() + this.extra) * NS_PER_CYCLE;
      this.extra = 0;
      this.busy += spent;
      clock.tick(spent);
    }
  }

  get #pending() {
    const { core } = this.chip;
    return (core.pendingInterrupts & core.enabledInterrupts) !== 0;
  }

  /** A processor that waits with interrupts off wakes up, and takes them when they are on again. */
  #wakeLocked() {
    const { core } = this.chip;
    const check = core.checkForInterrupts.bind(core);
    core.checkForInterrupts = () => (core.waiting && core.PM ? this.#pending : check());
  }

  #countExceptions() {
    const { core } = this.chip;
    for (const [name, cycles] of [['exceptionEntry', ENTRY_CYCLES], ['exceptionReturn', RETURN_CYCLES]]) {
      const plain = core[name].bind(core);
      core[name] = (number) => {
        this.extra += cycles;
        plain(number);
      };
    }
  }
}
