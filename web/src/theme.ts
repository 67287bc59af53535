/** The colours and the typeface that canvases need, read from styles/, following the system's light or dark. */

import { signal } from "@preact/signals";
import { CHANGE, mapTable } from "./colours";

const NAMES = ["ground", "ink", "muted", "line", "accent", "truth", "halo", "mesh"] as const;

export type Theme = Readonly<Record<(typeof NAMES)[number], string>> & {
  readonly dark: boolean;
  readonly map: Uint8Array;
  readonly font: string;
};

const darkQuery = window.matchMedia("(prefers-color-scheme: dark)");

function read(): Theme {
  const style = getComputedStyle(document.documentElement);
  const colours = Object.fromEntries(
    NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]),
  ) as Record<(typeof NAMES)[number], string>;
  return {
    ...colours,
    dark: darkQuery.matches,
    map: mapTable(darkQuery.matches ? CHANGE.dark : CHANGE.light),
    font: style.getPropertyValue("--font").trim(),
  };
}

export const theme = signal<Theme>(read());

/** Settles when the typeface is there, all of its files; or cannot be had, and another must do. */
export function typeface(): Promise<unknown> {
  return Promise.allSettled([...document.fonts].map((face) => face.load()));
}

darkQuery.addEventListener("change", () => {
  theme.value = read();
});
