/** Measurement rows grouped by drive, with a gap between drives, ready to plot. */

import type { PatternRows } from "../wire";

export interface Grouping {
  /** Place of each plotted point; a gap's place lies between two drives. */
  readonly places: readonly number[];
  /** Row shown at each place, -1 in a gap. */
  readonly rows: readonly number[];
  /** Each by its source and sink, and where its measurements begin and end. */
  readonly drives: readonly { readonly label: string; readonly from: number; readonly to: number }[];
}

/** Group a pattern's rows: consecutive rows of one source and sink belong together. */
export function groupByDrive(pattern: PatternRows): Grouping {
  const places: number[] = [];
  const rows: number[] = [];
  const drives: { label: string; from: number; to: number }[] = [];
  let last = "";
  for (let row = 0; row < pattern.n_meas; row++) {
    const [source, sink] = [pattern.drive[2 * row], pattern.drive[2 * row + 1]];
    const label = `${source + 1}–${sink + 1}`;
    if (label !== last && row > 0) {
      places.push(places.length);
      rows.push(-1);
    }
    if (label !== last) drives.push({ label, from: places.length, to: places.length });
    last = label;
    drives[drives.length - 1].to = places.length;
    places.push(places.length);
    rows.push(row);
  }
  return { places, rows, drives };
}

/** The values of rows at their places, null in gaps and where a value is missing. */
export function spread(grouping: Grouping, value: (row: number) => number): (number | null)[] {
  return grouping.rows.map((row) => {
    if (row < 0) return null;
    const v = value(row);
    return Number.isFinite(v) ? v : null;
  });
}
