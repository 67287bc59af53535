/** One setting as the schema describes it: a choice, a number, a quantity, a word; with its unit, its
 * meaning, and what is wrong with it. */

import type { KeyForm, Value } from "../wire";
import { change, discard, parted, refused, typed } from "./model";

const NAMES: Readonly<Record<string, string>> = {
  alpha: "α",
  gamma1: "Γ1",
  gamma2: "Γ2",
  snr: "Signal to noise",
  adc_bits: "Converter",
};

/** What is counted, where a number has no unit of its own. */
const COUNTED: Readonly<Record<string, string>> = {
  adc_bits: "bits",
  cells: "triangles",
  count: "electrodes",
  gain: "times",
  max_touches: "touches",
  oversampling: "readings",
  snr: "times the noise",
};

/** As on the bench. */
const UNITS: Readonly<Record<string, string>> = { deg: "°" };

/** How people call a key. */
export function nameOf(key: string): string {
  const words = key.replace(/_/g, " ");
  return NAMES[key] ?? words[0].toUpperCase() + words.slice(1);
}

/** What stands behind a key's value. */
export function unitOf(form: KeyForm, value: Value | null | undefined): string {
  const [, unit] = parted(value, form.kind);
  return UNITS[unit] ?? (unit.replace("ohm", "Ω").replace("*", "·") || (COUNTED[form.name] ?? ""));
}

export interface FieldProps {
  readonly section: string;
  readonly form: KeyForm;
  readonly value: Value | null | undefined;
}

/** Whether the last refusal is about this key. */
export const isRefused = (section: string, key: string): boolean =>
  refused.value?.section === section && refused.value.key === key;

/** Why a change was refused, and the way back. */
export function Refusal({ section, id }: { readonly section: string; readonly id: string }) {
  return (
    <p class="wrong" role="alert" id={id} data-testid="refused">
      {refused.value?.message}{" "}
      <button type="button" onClick={() => discard(section)}>
        Revert
      </button>
    </p>
  );
}

type InputProps = FieldProps & { readonly id: string; readonly describedBy: string };

function Choice({ section, form, value, id, describedBy }: InputProps) {
  return (
    <select
      id={id}
      data-testid={id}
      aria-describedby={describedBy}
      value={String(value ?? "")}
      onChange={(event) => change(section, { [form.name]: event.currentTarget.value || null })}
    >
      {value == null && <option value="">–</option>}
      {form.kind.words?.map((word) => (
        <option key={word} value={word}>
          {word}
        </option>
      ))}
    </select>
  );
}

function Typed({ section, form, value, id, describedBy }: InputProps) {
  const [shown] = parted(value, form.kind);
  const unit = unitOf(form, value);
  return (
    <span class="typed">
      <input
        id={id}
        data-testid={id}
        type="text"
        inputMode={form.kind.form === "number" ? "decimal" : "text"}
        autocomplete="off"
        spellcheck={false}
        aria-describedby={`${unit ? `${id}-unit ` : ""}${describedBy}`}
        aria-invalid={isRefused(section, form.name)}
        value={shown}
        placeholder={form.required ? "needed" : ""}
        disabled={form.locked}
        onChange={(event) => {
          const text = event.currentTarget.value;
          change(section, { [form.name]: text.trim() === "" ? null : typed(text, form.kind, value) });
        }}
      />
      {unit && (
        <span class="unit" id={`${id}-unit`}>
          {unit}
        </span>
      )}
    </span>
  );
}

export function Field(props: FieldProps) {
  const { section, form } = props;
  const id = `set-${section}-${form.name}`;
  const wrong = isRefused(section, form.name);
  const describedBy = wrong ? `${id}-wrong ${id}-help` : `${id}-help`;
  const Input = form.kind.form === "choice" ? Choice : Typed;
  return (
    <div class="field">
      <label for={id}>{nameOf(form.name)}</label>
      <Input {...props} id={id} describedBy={describedBy} />
      {wrong && <Refusal section={section} id={`${id}-wrong`} />}
      <p class="help" id={`${id}-help`}>
        {form.meaning}
      </p>
    </div>
  );
}
