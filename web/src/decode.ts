/** One binary frame of the server, as typed views on the bytes that arrived. */

const MAGIC = 0x314b5354; // "TSK1"
const HEADER = 40;
const TOUCH = 52;
const TRUTH = 16;
const BEND = 16;
const READY = 1;
const NO_PICTURE = 2;
const BENT = 8;

/** Median, and an interval that nine in ten lie in, N. */
export interface Force {
  readonly newtons: number;
  readonly low: number;
  readonly high: number;
  /** False: it rests on the skin file's material alone. */
  readonly calibrated: boolean;
}

export interface Touch {
  readonly id: number;
  readonly kind: "decrease" | "increase";
  readonly x: number;
  readonly y: number;
  /** One standard deviation, m; NaN where unknown. */
  readonly sdX: number;
  readonly sdY: number;
  /** m². */
  readonly covXy: number;
  /** m². */
  readonly area: number;
  /** N; null where no calibration tells it. */
  readonly force: Force | null;
  /** Signed change of conductivity at the peak, in the scene's unit. */
  readonly peak: number;
  /** Seconds since the touch began. */
  readonly since: number;
  /** How many it stands for: 0 one, 1 perhaps several, n > 1 that have come too close. */
  readonly several: number;
}

export type ForceState = "none" | "calibrated" | "uncalibrated";

/** What the forces of touches rest on: on a calibration only where every one does. */
export function forceStateOf(touches: readonly Touch[]): ForceState {
  const forces = touches.map(({ force }) => force).filter((force) => force !== null);
  if (!forces.length) return "none";
  return forces.every(({ calibrated }) => calibrated) ? "calibrated" : "uncalibrated";
}

export interface Truth {
  readonly x: number;
  readonly y: number;
  readonly force: number;
  readonly radius: number;
}

const BEND_STATES = ["idle", "bend", "touch", "bend and touch", "unknown"] as const;

/** How the sheet is bent; angles in rad. */
export interface Bend {
  readonly angle: number;
  /** One standard deviation. */
  readonly sd: number;
  /** From x, counter-clockwise. */
  readonly axis: number;
  readonly state: (typeof BEND_STATES)[number];
}

export interface Frame {
  readonly sequence: number;
  readonly hostTime: number;
  readonly referenceReady: boolean;
  /** False: too many rows are unusable, the image is not one. */
  readonly pictured: boolean;
  /** Bytes-in to touches-out, s. */
  readonly latency: number;
  readonly image: Float32Array;
  readonly voltages: Float32Array;
  readonly reference: Float32Array;
  readonly touches: readonly Touch[];
  readonly truths: readonly Truth[];
  /** Null: the bends of this skin were not learnt. */
  readonly bend: Bend | null;
  /** 0 none, k: the cell belongs to the k-th touch. */
  readonly labels: Uint8Array;
}

function touchAt(data: DataView, at: number): Touch {
  return {
    id: data.getUint32(at, true),
    kind: data.getUint8(at + 4) === 1 ? "increase" : "decrease",
    x: data.getFloat32(at + 8, true),
    y: data.getFloat32(at + 12, true),
    sdX: data.getFloat32(at + 16, true),
    sdY: data.getFloat32(at + 20, true),
    covXy: data.getFloat32(at + 36, true),
    area: data.getFloat32(at + 24, true),
    peak: data.getFloat32(at + 28, true),
    since: data.getFloat32(at + 32, true),
    several: data.getUint8(at + 5),
    force: forceAt(data, at),
  };
}

function forceAt(data: DataView, at: number): Force | null {
  const state = data.getUint8(at + 6);
  if (state === 0) return null;
  return {
    newtons: data.getFloat32(at + 40, true),
    low: data.getFloat32(at + 44, true),
    high: data.getFloat32(at + 48, true),
    calibrated: state === 1,
  };
}

function truthAt(data: DataView, at: number): Truth {
  return {
    x: data.getFloat32(at, true),
    y: data.getFloat32(at + 4, true),
    force: data.getFloat32(at + 8, true),
    radius: data.getFloat32(at + 12, true),
  };
}

function bendAt(data: DataView, at: number): Bend {
  return {
    angle: data.getFloat32(at, true),
    sd: data.getFloat32(at + 4, true),
    axis: data.getFloat32(at + 8, true),
    state: BEND_STATES[data.getUint32(at + 12, true)] ?? "unknown",
  };
}

/** Decode one frame. Throws RangeError for bytes that are not one. */
export function decodeFrame(buffer: ArrayBuffer): Frame {
  const data = new DataView(buffer);
  if (buffer.byteLength < HEADER || data.getUint32(0, true) !== MAGIC) {
    throw new RangeError("expected a frame beginning with TSK1");
  }
  const nCells = data.getUint32(16, true);
  const nMeas = data.getUint32(20, true);
  const nTouches = data.getUint16(24, true);
  const flags = data.getUint32(28, true);
  const nTruth = data.getUint16(26, true);
  const touchesAt = HEADER + 4 * (nCells + 2 * nMeas);
  const truthsAt = touchesAt + TOUCH * nTouches;
  const bendsAt = truthsAt + TRUTH * nTruth;
  const labelsAt = bendsAt + (flags & BENT ? BEND : 0);
  if (buffer.byteLength < labelsAt + nCells) {
    throw new RangeError(
      `expected ${labelsAt + nCells} bytes for ${nCells} cells, got ${buffer.byteLength}`,
    );
  }
  return {
    sequence: data.getUint32(4, true),
    hostTime: data.getFloat64(8, true),
    referenceReady: (flags & READY) !== 0,
    pictured: (flags & NO_PICTURE) === 0,
    latency: data.getUint32(32, true) * 1e-6,
    image: new Float32Array(buffer, HEADER, nCells),
    voltages: new Float32Array(buffer, HEADER + 4 * nCells, nMeas),
    reference: new Float32Array(buffer, HEADER + 4 * (nCells + nMeas), nMeas),
    touches: Array.from({ length: nTouches }, (_, k) => touchAt(data, touchesAt + TOUCH * k)),
    truths: Array.from({ length: nTruth }, (_, k) => truthAt(data, truthsAt + TRUTH * k)),
    bend: flags & BENT ? bendAt(data, bendsAt) : null,
    labels: new Uint8Array(buffer, labelsAt, nCells),
  };
}
