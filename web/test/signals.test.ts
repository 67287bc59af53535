import { describe, expect, it } from "vitest";
import type { PatternRows } from "../src/wire";
import { Log, NoiseMeter, reciprocalPairs, reciprocity } from "../src/signals/measures";

/** The adjacent pattern of n electrodes, as the server orders it. */
function adjacent(n: number): PatternRows {
  const drive: number[] = [];
  const measure: number[] = [];
  for (let k = 0; k < n; k++) {
    for (let j = 0; j < n; j++) {
      const pair = [j, (j + 1) % n];
      if (pair.includes(k) || pair.includes((k + 1) % n)) continue;
      drive.push((k + 1) % n, k);
      measure.push(...pair);
    }
  }
  return { name: "", n_meas: drive.length / 2, n_drive: n, drive, measure };
}

describe("reciprocity", () => {
  const pattern = adjacent(8);
  const pairs = reciprocalPairs(pattern);

  it("pairs every row of the adjacent pattern once", () => {
    expect(pairs.length).toBe(20);
    expect(new Set(pairs.flatMap(([a, b]) => [a, b])).size).toBe(40);
  });

  it("is nothing where rows agree, whatever their signs, and shows the row that does not", () => {
    const voltages = new Float32Array(40);
    pairs.forEach(([a, b, sign], k) => {
      voltages[a] = 1 + k;
      voltages[b] = sign * (1 + k);
    });
    expect(Math.max(...reciprocity(pairs, voltages).map(Math.abs))).toBe(0);
    voltages[pairs[3][0]] += 1;
    expect(reciprocity(pairs, voltages).filter((error) => error !== 0).length).toBe(1);
  });
});

it("noise is told from frame to frame, without drift", () => {
  const meter = new NoiseMeter();
  let seed = 1;
  const random = () => ((seed = (seed * 16807) % 2147483647) / 2147483647 - 0.5) * Math.sqrt(12);
  expect(meter.of(0)).toBeNaN();
  for (let k = 0; k < 4000; k++) meter.add(Float32Array.of(5 + 1e-3 * k + 1e-2 * random(), 3));
  expect(meter.of(0)).toBeGreaterThan(0.7e-2);
  expect(meter.of(0)).toBeLessThan(1.3e-2);
  expect(meter.of(1)).toBe(0);
});

it("a log holds one value a period, and forgets the oldest", () => {
  const log = new Log(2, 3);
  for (let time = 0; time < 20; time++) log.add(time, time);
  expect(log.values).toEqual([14, 16, 18]);
});
