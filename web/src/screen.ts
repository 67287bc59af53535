/** What the screen is like, where layout alone cannot follow it. */

import { signal } from "@preact/signals";

/** The same bound as in styles/narrow.css. */
const telephone = window.matchMedia("(max-width: 600px)");

/** Whether the page is as narrow as a telephone. */
export const narrow = signal(telephone.matches);
telephone.addEventListener("change", () => (narrow.value = telephone.matches));
