/** What the screen is like, where layout alone cannot follow it. */

import { signal } from "@preact/signals";

/** The same bound as in styles/narrow.css. */
const telephone = window.matchMedia("(max-width: 600px)");

/** Whether the page is as narrow as a telephone. */
export const narrow = signal(telephone.matches);

const coarse = window.matchMedia("(hover: none) and (pointer: coarse)");

/** Whether the page is pressed with fingers, without wheel and keys. */
export const fingers = signal(coarse.matches);
coarse.addEventListener("change", () => (fingers.value = coarse.matches));

telephone.addEventListener("change", () => (narrow.value = telephone.matches));
