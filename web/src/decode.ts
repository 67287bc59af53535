/** One binary frame of the server, as typed views on the bytes that arrived. */

import * as wire from "./wire";

/** Median, and an interval that nine in ten lie in, N or m; `high` is infinite beyond what was taught. */
export interface Amount {
  readonly value: number;
  readonly low: number;
  readonly high: number;
}

/** What calibrations tell of a touch. */
export type Measurand = "force" | "depth";

const amount = (value: number, low: number, high: number): Amount | null =>
  Number.isNaN(value) ? null : { value, low, high };

const KINDS = ["decrease", "increase"] as const;

function touchAt(data: DataView, at: number) {
  const { kind, force, forceLow, forceHigh, depth, depthLow, depthHigh, ...rest } = wire.readTouch(data, at);
  const amounts = { force: amount(force, forceLow, forceHigh), depth: amount(depth, depthLow, depthHigh) };
  return { ...rest, ...amounts, kind: KINDS[kind] };
}

/** Lengths m, deviations NaN where unknown; `force`, `depth` null where no calibration gives them; `several`:
 * how many it stands for: 0 one, 1 perhaps several, n > 1 that have come too close; `own`: 1 where a link of the
 * robot itself makes it. */
export type Touch = Readonly<ReturnType<typeof touchAt>>;

export type Truth = Readonly<ReturnType<typeof wire.readTruth>>;

/** What calibrations read beside touches, by their keys. */
export type Readings = Readonly<Record<string, wire.ShownReading>>;

const NOTHING_READ: Readings = {};

interface Read {
  readonly readings: Readings;
  /** How the sheet is deformed as a whole; null: as it was at rest. */
  readonly deformation: wire.DeformationNow | null;
}

const NOTHING: Read = { readings: NOTHING_READ, deformation: null };

function readAt(buffer: ArrayBuffer, at: number): Read {
  if (buffer.byteLength <= at) return NOTHING;
  const { deformation = null, ...readings } = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, at))) as Record<
    string,
    wire.ShownReading
  > & { readonly deformation?: wire.DeformationNow };
  return { readings, deformation };
}

/** By how much each node of the mesh has given way, and the deviation of that, in `wire.DENT_STEP`. */
export interface Dent {
  readonly deflection: Uint16Array;
  readonly deviation: Uint16Array;
}

export interface Frame extends Read {
  readonly sequence: number;
  readonly hostTime: number;
  readonly referenceReady: boolean;
  /** False: too many measurements are unusable, the image is not one. */
  readonly pictured: boolean;
  /** Bytes-in to touches-out, s. */
  readonly latency: number;
  readonly image: Float32Array;
  readonly voltages: Float32Array;
  readonly reference: Float32Array;
  readonly touches: readonly Touch[];
  readonly truths: readonly Truth[];
  /** 0 none, k: the cell belongs to the k-th touch. */
  readonly labels: Uint8Array;
  /** Null: nothing touches, the page has not asked for it, or depths are uncalibrated. */
  readonly dent: Dent | null;
}

/** Decode one frame. Throws RangeError for bytes that are not one. */
export function decodeFrame(buffer: ArrayBuffer): Frame {
  const data = new DataView(buffer);
  if (buffer.byteLength < wire.HEADER_BYTES || data.getUint32(0, true) !== wire.MAGIC) {
    throw new RangeError("expected a frame beginning with TSK1");
  }
  const { sequence, hostTime, nCells, nMeas, nTouches, nTruth, flags, latencyUs, nDent } = wire.readHeader(data, 0);
  const touchesAt = wire.HEADER_BYTES + 4 * (nCells + 2 * nMeas);
  const truthsAt = touchesAt + wire.TOUCH_BYTES * nTouches;
  const labelsAt = truthsAt + wire.TRUTH_BYTES * nTruth;
  const dentAt = labelsAt + 4 * Math.ceil(nCells / 4);
  if (buffer.byteLength < (nDent ? dentAt + 4 * nDent : labelsAt + nCells)) {
    throw new RangeError(
      `expected ${labelsAt + nCells} bytes for ${nCells} cells, got ${buffer.byteLength}`,
    );
  }
  const floats = (from: number, count: number) => new Float32Array(buffer, wire.HEADER_BYTES + 4 * from, count);
  return {
    sequence,
    hostTime,
    referenceReady: (flags & wire.FLAGS.ready) !== 0,
    pictured: (flags & wire.FLAGS.noImage) === 0,
    latency: latencyUs * 1e-6,
    image: floats(0, nCells),
    voltages: floats(nCells, nMeas),
    reference: floats(nCells + nMeas, nMeas),
    touches: Array.from({ length: nTouches }, (_, k) => touchAt(data, touchesAt + wire.TOUCH_BYTES * k)),
    truths: Array.from({ length: nTruth }, (_, k) => wire.readTruth(data, truthsAt + wire.TRUTH_BYTES * k)),
    labels: new Uint8Array(buffer, labelsAt, nCells),
    dent: nDent
      ? {
          deflection: new Uint16Array(buffer, dentAt, nDent),
          deviation: new Uint16Array(buffer, dentAt + 2 * nDent, nDent),
        }
      : null,
    ...readAt(buffer, dentAt + 4 * nDent),
  };
}
