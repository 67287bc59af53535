/** Numbers as people read them: fixed decimals, a true minus sign, a space for a plus. */

const MINUS = "\u2212";

/** A number with fixed decimals and a true minus; a dash where there is none. */
export function fixed(value: number | null, decimals: number): string {
  if (value === null || !Number.isFinite(value)) return "–";
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

/** Metres as millimetres. */
export function millimetres(metres: number, decimals = 1): string {
  return fixed(metres * 1e3, decimals);
}

/** How values of one quantity are shown: shown = value · factor, in `unit`. */
export interface Scale {
  readonly factor: number;
  readonly unit: string;
  readonly decimals: number;
}

const PREFIXES: readonly (readonly [number, string])[] = [
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
];

/** The scale in which `largest` has one to three digits before the point. */
export function scaleFor(largest: number, unit: string): Scale {
  const size = Math.abs(largest);
  if (unit === "relative") return { factor: 100, unit: "%", decimals: size * 100 < 10 ? 1 : 0 };
  const [step, prefix] = PREFIXES.find(([step]) => size >= step * 0.0999) ?? [1, ""];
  const shown = size / step;
  const decimals = shown < 1 ? 3 : shown < 10 ? 2 : shown < 100 ? 1 : 0;
  return { factor: 1 / step, unit: prefix + unit, decimals };
}

/** A value in its scale, without the unit. */
export function inScale(value: number, scale: Scale): string {
  return fixed(value * scale.factor, scale.decimals);
}

/** The next of 1, 1.5, 2, 3, 5, 7 × 10ⁿ at or above a positive value. */
export function niceAbove(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const decade = 10 ** Math.floor(Math.log10(value));
  const step = [1, 1.5, 2, 3, 5, 7, 10].find((s) => s * decade >= value * (1 - 1e-9)) ?? 10;
  return Number((step * decade).toPrecision(3));
}

/** A duration in words that a glance takes in: "4 s", "3 min", "2 h". */
export function duration(seconds: number): string {
  if (seconds < 99.5) return `${Math.max(0, Math.round(seconds))} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}
