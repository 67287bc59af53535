/** Settings that are drawn rather than typed: alpha on a logarithmic scale, the thresholds. */

import { change, settings, soon } from "./model";
import { status } from "../state";
import type { KeyForm, Value } from "../wire";
import { alpha, alphaInFull } from "../words";
import { nameOf } from "./Field";

/** Decades of alpha to either side of the automatic choice. */
const DECADES = 3;
const STEPS = 120;

export function Alpha({ value }: { readonly value: Value | null | undefined }) {
  const now = settings.value;
  if (!now) return null;
  const automatic = now.automatic_alpha;
  const centre = automatic ?? now.alpha;
  const present = typeof value === "number" ? value : now.alpha;
  const place = (alpha: number) => Math.log10(alpha / centre) * (STEPS / DECADES);
  const send = (next: Value) => change("inverse", { alpha: next });
  const mark = automatic === null ? null : 50 + (50 * place(automatic)) / STEPS;
  return (
    <div class="field slider">
      <label for="set-alpha">α, weight of the prior</label>
      <output data-testid="alpha" title={status.value ? alphaInFull(status.value) : ""}>
        {status.value ? alpha(status.value) : Number(present.toPrecision(2))}
      </output>
      <div class="track">
        {mark !== null && <i class="mark" style={{ left: `${mark}%` }} title="The automatic choice" />}
        <input
          id="set-alpha"
          data-testid="set-alpha"
          type="range"
          min={-STEPS}
          max={STEPS}
          step={1}
          value={place(present)}
          aria-valuetext={`${Number(present.toPrecision(2))}`}
          onInput={(event) => {
            const next = centre * 10 ** ((Number(event.currentTarget.value) * DECADES) / STEPS);
            soon(() => send(Number(next.toPrecision(3))));
          }}
        />
      </div>
      <button type="button" aria-pressed={value === "auto"} data-testid="alpha-auto" onClick={() => send("auto")}>
        Automatic
      </button>
      <p class="help">
        To the left images are sharper, to the right calmer. Automatic
        {automatic === null ? "" : ` (${Number(automatic.toPrecision(2))}, marked)`} follows the noise.
      </p>
    </div>
  );
}

export function Threshold({ form, value }: { readonly form: KeyForm; readonly value: Value | null | undefined }) {
  const id = `set-touch-${form.name}`;
  return (
    <div class="field slider">
      <label for={id}>{nameOf(form.name)}</label>
      <output>{Number(value).toFixed(2)}</output>
      <div class="track">
        <input
          id={id}
          data-testid={id}
          type="range"
          min={form.kind.low ?? 0}
          max={form.kind.high ?? 1}
          step={0.01}
          value={Number(value)}
          onInput={(event) => {
            const next = Number(event.currentTarget.value);
            soon(() => change("touch", { [form.name]: next }));
          }}
        />
      </div>
      <p class="help">{form.meaning}</p>
    </div>
  );
}
