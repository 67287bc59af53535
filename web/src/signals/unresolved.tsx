/** What the data cannot tell: one map for all frames, on the sheet while its tab is open. */

import { computed, effect, signal } from "@preact/signals";
import { AMOUNT, mapTable } from "../colours";
import { fixed, millimetres } from "../format";
import { link, onMessage, scene, send, status } from "../state";
import type { UnresolvedMap } from "../wire";

const answer = signal<UnresolvedMap | null>(null);
/** Whether its tab is open. */
export const wanted = signal(false);

onMessage("unresolved", (message) => (answer.value = message));

/** What the map follows from: it changes with these, and with no frame. */
const cause = computed(() => {
  const now = status.value;
  return now && [now.alpha, now.sick.map(({ electrode }) => electrode).join(), scene.value?.skin.name].join(" ");
});

effect(() => {
  if (wanted.value && cause.value && link.value.phase === "open") send({ type: "unresolved" });
});

/** One value per cell while the map is shown on the sheet, else null. */
export const unresolved = computed(() => {
  const cells = (scene.value?.cells.length ?? 0) / 3;
  const values = wanted.value ? answer.value?.values : null;
  return values?.length === cells ? Float32Array.from(values) : null;
});

/** As the picture takes it, -1 to 1, and the colours for it. */
export const painted = computed(() => unresolved.value?.map((value) => 2 * value - 1) ?? null);
export const AMOUNTS = mapTable(AMOUNT);

export const percent = (value: number): string => fixed(100 * value, 0);

export function Unresolved() {
  const values = unresolved.value;
  if (!values) return <p class="wrong">{answer.value?.problem}</p>;
  const sorted = Float32Array.from(values).sort();
  const at = (part: number) => percent(sorted[Math.floor(part * (sorted.length - 1))]);
  return (
    <dl class="identity" data-testid="signals-sum">
      <dt>Where the data tell most</dt>
      <dd>{at(0)} % left open</dd>
      <dt>Median of the sheet</dt>
      <dd>{at(0.5)} %</dd>
      <dt>Where they tell least</dt>
      <dd>{at(1)} %</dd>
      <dt>Disc about each position</dt>
      <dd>radius {millimetres(answer.value?.radius_m ?? 0, 0)} mm</dd>
    </dl>
  );
}
