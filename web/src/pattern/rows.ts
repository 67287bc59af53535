/** The rows of a pattern as a person edits them: typed words, checked one by one. Pure. */

import type { PatternRows } from "../wire";

/** Source, sink, plus, minus as they were typed, E1 first. */
export type Cells = readonly [string, string, string, string];

export interface Row {
  /** Stays with the row while others come and go. */
  readonly id: number;
  readonly cells: Cells;
}

/** As people read them; the minus is a true one. */
export const COLUMNS = ["drive +", "drive \u2212", "read +", "read \u2212"] as const;

export interface Tables {
  readonly drive: readonly (readonly number[])[];
  readonly measure: readonly (readonly number[])[];
}

let issued = 0;

/** A row that no other one is. */
export const fresh = (cells: Cells): Row => ({ id: issued++, cells });

/** The number of an electrode, counted from 1, of "3", "E3" or " e3 "; null: it is none. */
export function electrode(cell: string): number | null {
  const found = /^\s*E?(\d{1,3})\s*$/i.exec(cell);
  return found ? Number(found[1]) : null;
}

/** Rows of tables that count from 0. */
export function fromTables({ drive, measure }: Tables): Row[] {
  return drive.map(([source, sink], k) => {
    const [plus, minus] = measure[k];
    return fresh([source, sink, plus, minus].map((e) => String(e + 1)) as unknown as Cells);
  });
}

/** The skin's present rows. */
export function fromPattern({ n_meas, drive, measure }: PatternRows): Row[] {
  const pairs = (flat: readonly number[]) =>
    Array.from({ length: n_meas }, (_, k) => [flat[2 * k], flat[2 * k + 1]]);
  return fromTables({ drive: pairs(drive), measure: pairs(measure) });
}

/** Lines of four words each, as they come from a spreadsheet or a file; null: they are not so. */
export function fromText(text: string): Row[] | null {
  const lines = text.split("\n").map((line) => line.trim()).filter((line) => line !== "");
  const found = lines.map((line) => line.split(/[\s,;]+/));
  if (!found.length || found.some((cells) => cells.length !== 4)) return null;
  return found.map((cells) => fresh(cells as unknown as Cells));
}

function wrong(cell: string, name: string, n: number): string | null {
  const number = electrode(cell);
  if (number === null) return `${name}: expected an electrode from E1 to E${n}, got “${cell.trim()}”`;
  return number >= 1 && number <= n ? null : `${name}: this skin has E1 to E${n}, not E${number}`;
}

function problem({ cells }: Row, n: number): string | null {
  for (let k = 0; k < 4; k++) {
    const found = wrong(cells[k], COLUMNS[k], n);
    if (found) return found;
  }
  const [source, sink, plus, minus] = cells.map(electrode);
  if (source === sink) return `${COLUMNS[0]} and ${COLUMNS[1]} are both E${source}`;
  return plus === minus ? `${COLUMNS[2]} and ${COLUMNS[3]} are both E${plus}` : null;
}

/** What is wrong with each row, by its identity; rows that are well are not in it. */
export function problems(rows: readonly Row[], n: number): ReadonlyMap<number, string> {
  const found = new Map<number, string>();
  const seen = new Map<string, number>();
  rows.forEach((row, at) => {
    const words = problem(row, n);
    if (words) {
      found.set(row.id, words);
      return;
    }
    const [source, sink, plus, minus] = row.cells.map(electrode) as number[];
    const key = [source, sink, Math.min(plus, minus), Math.max(plus, minus)].join(" ");
    const before = seen.get(key);
    if (before === undefined) seen.set(key, at);
    else found.set(row.id, `measures the same pair under the same drive as row ${before + 1}`);
  });
  return found;
}

/** What the skin file holds of rows that are well. */
export function toTables(rows: readonly Row[]): Tables {
  const numbers = rows.map(({ cells }) => cells.map((cell) => (electrode(cell) ?? 1) - 1));
  return {
    drive: numbers.map(([source, sink]) => [source, sink]),
    measure: numbers.map(([, , plus, minus]) => [plus, minus]),
  };
}

/** How many different drives there are. */
export function countDrives(rows: readonly Row[]): number {
  return new Set(rows.map(({ cells }) => cells.slice(0, 2).map(electrode).join(" "))).size;
}
