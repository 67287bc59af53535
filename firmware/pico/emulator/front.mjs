// What the pins of firmware/pico/pins.h are connected to: switches, multiplexer, amplifier; and
// what is seen of them. What the switches must never do is complained of.
import { GPIOPinState } from 'rp2040js';

const SOURCE_SHIFT = 2;
const SINK_SHIFT = 7;
const READ_SHIFT = 12;
const FIVE_BITS = 31;
const SOURCE_ENABLE = 17;
const SINK_ENABLE = 18;
const LATCH = 19;
const REGULATOR = 23;
const AMPLIFIER = 0;
const NONE = -1;
const LEAST_DEAD_NS = 1000;
const MULTIPLEXER_NS = 1500;
const CONVERSION_NS = 2000;
const WORD_NS = 1320; // of 16 bits at 12.5 MHz, and the selection before
const NOTHING = 0xffff; // what a pin reads that is pulled up
const DMA_CHANNEL = 0;

export class Front {
  /** `skin` gives codes; `watch` takes what is seen; `complain` a sentence; `external`: there is an ADS7042. */
  constructor(skin, watch, complain, external) {
    this.external = external;
    this.skin = skin;
    this.watch = watch;
    this.complain = complain;
    this.source = this.sink = NONE;
    this.pair = [NONE, NONE];
    this.opened = -Infinity;
    this.since = 0;
    this.passed = 0;
  }

  /** Stand before a chip that has just been powered on or reset: its pins float. */
  attach(chip, now) {
    this.chip = chip;
    this.now = now;
    this.latched = 0;
    this.read = this.before = 0;
    this.readSince = -Infinity;
    this.#connect(NONE, NONE);
    for (const pin of [SOURCE_ENABLE, SINK_ENABLE, LATCH]) {
      chip.gpio[pin].addListener(() => this.#onControl());
    }
    for (let bit = 0; bit < 5; bit++) {
      chip.gpio[READ_SHIFT + bit].addListener(() => this.#onRead());
    }
    const done = chip.clock.createAlarm(() => chip.adc.completeADCRead(this.code, false));
    const dma = chip.dma.channels[DMA_CHANNEL];
    this.#follow(this.external ? chip.spi[0].rxFIFO : chip.adc.fifo, dma);
    chip.adc.onADCRead = (input) => {
      if (this.external) {
        this.code = 0; // it only sets the pace
      } else {
        this.code = this.#convert(input);
      }
      done.schedule(CONVERSION_NS);
    };
    const sent = chip.clock.createAlarm(() => chip.spi[0].completeTransmit(this.word));
    chip.spi[0].onTransmit = () => {
      this.word = this.external ? this.#convert(AMPLIFIER) << 2 : NOTHING;
      sent.schedule(WORD_NS);
    };
  }

  #high(pin) {
    return this.chip.gpio[pin].value === GPIOPinState.High;
  }

  #address(shift) {
    return (this.chip.sio.gpioValue >>> shift) & FIVE_BITS;
  }

  #onControl() {
    if (!this.#high(LATCH)) {
      this.latched = this.chip.sio.gpioValue;
    }
    const source = this.#high(SOURCE_ENABLE) ? (this.latched >>> SOURCE_SHIFT) & FIVE_BITS : NONE;
    const sink = this.#high(SINK_ENABLE) ? (this.latched >>> SINK_SHIFT) & FIVE_BITS : NONE;
    const wasOn = this.source !== NONE && this.sink !== NONE;
    if (source === this.source && sink === this.sink) {
      return;
    }
    const isOn = source !== NONE && sink !== NONE;
    if (isOn && wasOn) {
      this.complain('make before break');
    }
    if (isOn && !wasOn && this.now() - this.opened < LEAST_DEAD_NS) {
      this.complain('dead time too short');
    }
    if (isOn && !this.#high(REGULATOR)) {
      this.complain('the regulator may burst');
    }
    if (isOn && source === sink) {
      this.complain('source = sink');
    }
    this.#connect(source, sink);
  }

  #connect(source, sink) {
    const was = this.source !== NONE || this.sink !== NONE;
    const is = source !== NONE || sink !== NONE;
    const now = this.#pass();
    if (was && !is) {
      this.opened = now;
      this.watch.ended(now - this.since, ...this.pair);
    }
    this.source = source;
    this.sink = sink;
    if (source !== NONE && sink !== NONE) {
      this.pair = [source, sink]; // the two enables do not go at once
    }
    if (!was && is) {
      this.watch.began(now - this.opened);
      this.since = now;
    }
  }

  /** What has flowed until now has charged the electrodes. */
  #pass() {
    const now = this.now();
    this.skin.pass(this.source, this.sink, now - this.passed);
    this.passed = now;
    return now;
  }

  #onRead() {
    const read = this.#address(READ_SHIFT);
    if (read !== this.read) {
      this.before = this.read;
      this.read = read;
      this.readSince = this.now();
    }
  }

  /** What a conversion goes through until DMA fetches it, as one of so many for a sample. */
  #follow(fifo, dma) {
    const waiting = [];
    const push = fifo.push.bind(fifo);
    const pull = fifo.pull.bind(fifo);
    fifo.push = (code) => {
      waiting.push(this.begun);
      push(code);
    };
    fifo.pull = () => {
      const begun = waiting.shift();
      if (dma.active) {
        this.watch.fetched(begun, this.read, dma.transCount);
      }
      return pull();
    };
  }

  /** The code of a conversion that begins now; of the channel before while the switch settles. */
  #convert(input) {
    if (input !== AMPLIFIER) {
      this.complain(`converter input ${input} has nothing on it`);
    }
    const now = this.#pass();
    const channel = now - this.readSince < MULTIPLEXER_NS ? this.before : this.read;
    this.begun = { source: this.source, sink: this.sink, channel, after: now - this.since };
    return this.skin.code(this.source, this.sink, channel);
  }
}
