/** The diverging colour map, derived in OKLab: equal lightness and chroma on both arms, steps of
 * equal perceptual length, hues (blue, orange) that every common colour vision tells apart.
 * OKLab after B. Ottosson, https://bottosson.github.io/posts/oklab/. */

export type Rgb = readonly [number, number, number];

export interface MapDesign {
  /** OKLab lightness at zero, where there is no chroma. */
  readonly neutral: number;
  readonly pole: { readonly lightness: number; readonly chroma: number };
  /** OKLab hues below and above zero, degrees. */
  readonly hues: readonly [number, number];
}

export const LIGHT_MAP: MapDesign = {
  neutral: 0.985,
  pole: { lightness: 0.47, chroma: 0.125 },
  hues: [256, 46],
};

export const DARK_MAP: MapDesign = {
  neutral: 0.25,
  pole: { lightness: 0.78, chroma: 0.11 },
  hues: [246, 62],
};

/** Odd, so that zero has a colour of its own. */
export const MAP_SIZE = 511;

const encode = (linear: number): number =>
  linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;

/** OKLab to sRGB, each channel 0…1 inside the gamut, unclamped. */
export function oklabToRgb(lightness: number, a: number, b: number): Rgb {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    encode(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    encode(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    encode(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

/** A point of one arm, u in [0, 1] from zero to the pole: lightness falls (or rises) evenly, chroma
 * rises early so that small changes already have a colour. Returns lightness and chroma. */
function armPoint(design: MapDesign, u: number): readonly [number, number] {
  const { neutral, pole } = design;
  return [neutral + (pole.lightness - neutral) * u, pole.chroma * (1 - (1 - u) ** 2)];
}

/** One arm at `steps` + 1 places of equal OKLab distance, zero first: lightness and chroma. */
export function evenArm(design: MapDesign, steps: number): (readonly [number, number])[] {
  const fine = 64 * steps;
  const travelled = new Float64Array(fine + 1);
  for (let k = 1; k <= fine; k++) {
    const [l0, c0] = armPoint(design, (k - 1) / fine);
    const [l1, c1] = armPoint(design, k / fine);
    travelled[k] = travelled[k - 1] + Math.hypot(l1 - l0, c1 - c0);
  }
  const arm: (readonly [number, number])[] = [];
  for (let k = 0, at = 0; k <= steps; k++) {
    const goal = (travelled[fine] * k) / steps;
    while (at < fine && travelled[at] < goal) at++;
    arm.push(armPoint(design, at / fine));
  }
  return arm;
}

/** The map as RGBA bytes, from -1 to 1. */
export function mapTable(design: MapDesign, size = MAP_SIZE): Uint8Array {
  const table = new Uint8Array(4 * size).fill(255);
  const middle = (size - 1) / 2;
  const directions = design.hues.map((hue) => (hue * Math.PI) / 180);
  evenArm(design, middle).forEach(([lightness, chroma], k) => {
    directions.forEach((hue, arm) => {
      const at = arm === 0 ? middle - k : middle + k;
      const rgb = oklabToRgb(lightness, chroma * Math.cos(hue), chroma * Math.sin(hue));
      rgb.forEach((channel, c) => {
        table[4 * at + c] = Math.round(255 * Math.min(1, Math.max(0, channel)));
      });
    });
  });
  return table;
}

/** The table's entry for a value against its limit. */
export function mapIndex(value: number, limit: number, size = MAP_SIZE): number {
  const t = Math.min(1, Math.max(-1, value / limit));
  return Math.round((t * 0.5 + 0.5) * (size - 1));
}
