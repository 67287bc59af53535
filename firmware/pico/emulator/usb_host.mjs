// The computer at the other end of the cable: it makes the device's acquaintance as a USB host
// does, and then carries bytes between the serial port and endpoint 2.
import { Buffer } from 'node:buffer';

const PULL_UP = 1 << 16;
const SUSPENDED = 1 << 4;
const RESUMED = 1 << 11;
const SIE_STATUS = 0x50;
const DATA = 2;
const PACKET_NS = 53_000; // 19 packets a millisecond
const GAP_NS = 20_000;
const DTR_RTS = 3;

const request = (kind, number, value, index, length) =>
  Uint8Array.of(kind, number, value & 255, value >> 8, index & 255, index >> 8, length & 255, length >> 8);
const descriptor = (type, index, length) => request(0x80, 6, (type << 8) | index, 0, length);

export class UsbHost {
  /** `received` is called with bytes of the serial line, `said` with the serial number. */
  constructor(chip, received, said) {
    this.usb = chip.usbCtrl;
    this.clock = chip.clock;
    this.received = received;
    this.said = said;
    this.plugged = true;
    this.started = this.up = false;
    this.stalled = false;
    this.held = false;
    this.unsent = [];
    this.armed = new Map();
    this.#patch();
  }

  /** Between two looks: whether the device has come up, and what waits for it. */
  look() {
    if (this.plugged && !this.started && this.usb.sieCtrl & PULL_UP) {
      this.started = true;
      this.usb.resetDevice();
    }
    if (this.held && !this.stalled) {
      this.held = false;
      this.#ready(DATA, false);
    }
    this.#feed();
  }

  /** Bytes for the device's serial line. */
  send(bytes) {
    this.unsent.push(...bytes);
  }

  get waiting() {
    return this.unsent.length;
  }

  unplug() {
    this.plugged = this.started = this.up = false;
    this.usb.sieStatus |= SUSPENDED;
    this.usb.sieStatusUpdated();
  }

  plug() {
    this.plugged = true;
    this.usb.sieStatus |= RESUMED;
    this.usb.sieStatusUpdated();
  }

  #patch() {
    const { usb } = this;
    const write = usb.writeUint32.bind(usb);
    usb.writeUint32 = (offset, value) => {
      if (offset === SIE_STATUS && usb.rawWriteValue & SUSPENDED) {
        usb.sieStatus &= ~SUSPENDED; // rp2040js does not let it be cleared
      }
      write(offset, value);
    };
    this.#ready = usb.indicateBufferReady.bind(usb);
    const packet = this.clock.createAlarm(() => {
      this.held = this.stalled || !this.plugged;
      if (!this.held) {
        this.#ready(DATA, false);
      }
    });
    usb.indicateBufferReady = (endpoint, out) => {
      if (endpoint === DATA && !out) {
        packet.schedule(PACKET_NS); // rp2040js takes no time for it
      } else {
        this.#ready(endpoint, out);
      }
    };
    this.gap = this.clock.createAlarm(() => usb.sendSetupPacket(this.request.setup));
    usb.onResetReceived = () => this.#enumerate();
    usb.onEndpointRead = (endpoint) => this.#onArmed(endpoint);
    usb.onEndpointWrite = (endpoint, bytes) => this.#onWritten(endpoint, bytes);
  }

  #ready = () => {};

  #enumerate() {
    let size = 0;
    const text = (bytes) => this.said(Buffer.from(bytes.slice(2)).toString('utf16le'));
    this.armed.clear();
    this.requests = [
      { setup: request(0, 5, 1, 0, 0) },
      { setup: descriptor(1, 0, 18), expected: 18 },
      { setup: descriptor(2, 0, 9), expected: 9, then: (bytes) => (size = bytes[2]) },
      { setup: () => descriptor(2, 0, size), expected: () => size },
      { setup: descriptor(3, 3, 255), expected: 255, then: text },
      { setup: request(0, 9, 1, 0, 0) },
      { setup: request(0x21, 0x20, 0, 0, 7), data: Uint8Array.of(0x40, 0x42, 0x0f, 0, 0, 0, 8) },
      { setup: request(0x21, 0x22, DTR_RTS, 0, 0), then: () => (this.up = true) },
    ];
    this.#next();
  }

  #next() {
    const next = this.requests.shift();
    if (next === undefined) {
      this.request = undefined;
      return;
    }
    const value = (of) => (typeof of === 'function' ? of() : of);
    const { then = () => {}, data } = next;
    this.request = { setup: value(next.setup), expected: value(next.expected) ?? 0, then, data };
    this.request.bytes = [];
    this.armed.delete(0);
    this.gap.schedule(GAP_NS);
  }

  #onArmed(endpoint) {
    this.armed.set(endpoint, true);
    if (endpoint === DATA) {
      this.#feed();
    } else if (this.request?.data !== undefined) {
      this.#give(0, this.request.data);
    } else if (this.request?.finished) {
      this.#finish();
    }
  }

  #give(endpoint, bytes) {
    this.armed.delete(endpoint);
    this.usb.endpointReadDone(endpoint, bytes);
  }

  #onWritten(endpoint, bytes) {
    if (endpoint === DATA) {
      this.received(bytes);
    } else if (endpoint === 0 && this.request !== undefined) {
      this.request.bytes.push(...bytes);
      const { expected } = this.request;
      this.request.finished = bytes.length < 64 || this.request.bytes.length >= expected;
      if (this.request.finished && (expected === 0 || this.armed.has(0))) {
        this.#finish();
      }
    }
  }

  #finish() {
    if (this.request.expected > 0) {
      this.#give(0, new Uint8Array(0));
    }
    this.request.then(this.request.bytes);
    this.#next();
  }

  #feed() {
    if (this.up && this.unsent.length > 0 && this.armed.has(DATA)) {
      this.#give(DATA, Uint8Array.from(this.unsent.splice(0, 64)));
    }
  }
}
