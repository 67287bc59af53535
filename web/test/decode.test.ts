import { describe, expect, it } from "vitest";
import { decodeFrame } from "../src/decode";

/** Five cells, three rows, one touch, one press: built as the server builds it. */
function sample(): ArrayBuffer {
  const bytes = new ArrayBuffer(40 + 4 * (5 + 6) + 64 + 16 + 8);
  const data = new DataView(bytes);
  new Uint8Array(bytes).set([0x54, 0x53, 0x4b, 0x31]); // "TSK1"
  data.setUint32(4, 77, true);
  data.setFloat64(8, 12.5, true);
  data.setUint32(16, 5, true);
  data.setUint32(20, 3, true);
  data.setUint16(24, 1, true);
  data.setUint16(26, 1, true);
  data.setUint32(28, 1, true);
  data.setUint32(32, 250, true);
  for (let k = 0; k < 11; k++) data.setFloat32(40 + 4 * k, k / 4, true);
  const touch = 84;
  data.setUint32(touch, 9, true);
  data.setUint8(touch + 4, 1);
  data.setUint8(touch + 5, 2);
  [4, 3.5, 4.75, Number.NaN, Number.NaN, Number.NaN].forEach((v, k) => data.setFloat32(touch + 40 + 4 * k, v, true));
  [0.01, -0.02, Number.NaN, Number.NaN, 3e-4, 0.5, 1.5].forEach((v, k) =>
    data.setFloat32(touch + 8 + 4 * k, v, true),
  );
  [0.01, -0.02, 4, 0.008].forEach((v, k) => data.setFloat32(148 + 4 * k, v, true));
  new Uint8Array(bytes, 164).set([0, 1, 1, 0, 0]);
  return bytes;
}

describe("decodeFrame", () => {
  it("reads every section", () => {
    const frame = decodeFrame(sample());
    expect(frame).toMatchObject({ sequence: 77, hostTime: 12.5, referenceReady: true, pictured: true });
    expect(frame.latency).toBeCloseTo(250e-6);
    expect([...frame.image]).toEqual([0, 0.25, 0.5, 0.75, 1]);
    expect([...frame.voltages]).toEqual([1.25, 1.5, 1.75]);
    expect([...frame.reference]).toEqual([2, 2.25, 2.5]);
    expect([...frame.labels]).toEqual([0, 1, 1, 0, 0]);
    expect(frame.touches[0]).toMatchObject({ id: 9, kind: "increase", peak: 0.5, since: 1.5, several: 2 });
    expect(frame.touches[0].x).toBeCloseTo(0.01);
    expect(frame.touches[0].sdX).toBeNaN();
    expect(frame.touches[0].force).toEqual({ value: 4, low: 3.5, high: 4.75 });
    expect(frame.touches[0].depth).toBeNull();
    expect(frame.truths[0].radius).toBeCloseTo(0.008);
    expect(frame.readings).toEqual({});
  });

  it("reads what calibrations have read after all else", () => {
    const said = new TextEncoder().encode('{"bend":{"words":"bent","value":"29°"}}');
    const bytes = new Uint8Array(172 + said.length);
    bytes.set(new Uint8Array(sample()));
    bytes.set(said, 172);
    const frame = decodeFrame(bytes.buffer);
    expect(frame.readings).toEqual({ bend: { words: "bent", value: "29°" } });
    expect([...frame.labels]).toEqual([0, 1, 1, 0, 0]);
  });

  it("reads how the sheet is deformed beside them", () => {
    expect(decodeFrame(sample()).deformation).toBeNull();
    const said = new TextEncoder().encode('{"bend":{"words":"bent"},"deformation":{"kind":"fold"}}');
    const bytes = new Uint8Array(172 + said.length);
    bytes.set(new Uint8Array(sample()));
    bytes.set(said, 172);
    const { readings, deformation } = decodeFrame(bytes.buffer);
    expect(readings).toEqual({ bend: { words: "bent" } });
    expect(deformation).toEqual({ kind: "fold" });
  });

  it("reads the dent after the labels, where there is one", () => {
    expect(decodeFrame(sample()).dent).toBeNull();
    const bytes = new Uint8Array(172 + 8);
    bytes.set(new Uint8Array(sample()));
    const data = new DataView(bytes.buffer);
    data.setUint32(36, 2, true);
    [500, 0, 50, 7].forEach((count, k) => data.setUint16(172 + 2 * k, count, true));
    const { dent, labels } = decodeFrame(bytes.buffer);
    expect([...(dent?.deflection ?? [])]).toEqual([500, 0]);
    expect([...(dent?.deviation ?? [])]).toEqual([50, 7]);
    expect([...labels]).toEqual([0, 1, 1, 0, 0]);
    expect(() => decodeFrame(bytes.buffer.slice(0, 176))).toThrow(RangeError);
  });

  it("refuses foreign, short and empty bytes", () => {
    expect(() => decodeFrame(new ArrayBuffer(0))).toThrow(RangeError);
    expect(() => decodeFrame(new ArrayBuffer(64))).toThrow("TSK1");
    expect(() => decodeFrame(sample().slice(0, 100))).toThrow(RangeError);
    expect(() => decodeFrame(sample().slice(0, 60))).toThrow("expected");
  });
});
