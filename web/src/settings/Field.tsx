/** One setting as the schema describes it: a choice, a number, a quantity, a word. */

import { change, type KeyForm, refused, type Value, typed } from "./model";

const NAMES: Readonly<Record<string, string>> = {
  alpha: "α",
  gamma1: "Γ1",
  gamma2: "Γ2",
  snr: "Signal to noise",
  adc_bits: "Converter, bits",
};

/** How people call a key. */
export function nameOf(key: string): string {
  const words = key.replace(/_/g, " ");
  return NAMES[key] ?? words[0].toUpperCase() + words.slice(1);
}

export interface FieldProps {
  readonly section: string;
  readonly form: KeyForm;
  readonly value: Value | null | undefined;
}

/** The input that fits, and what it sends. */
function Input({ section, form, value, id }: FieldProps & { id: string }) {
  const send = (next: Value | null) => change(section, { [form.name]: next });
  const describedBy = `${id}-hint`;
  if (form.kind.form === "choice") {
    return (
      <select
        id={id}
        data-testid={id}
        aria-describedby={describedBy}
        value={String(value ?? "")}
        onChange={(event) => send(event.currentTarget.value || null)}
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
  const shown = Array.isArray(value) ? value.join(", ") : String(value ?? "");
  return (
    <input
      id={id}
      data-testid={id}
      type="text"
      inputMode={form.kind.form === "number" ? "decimal" : "text"}
      autocomplete="off"
      spellcheck={false}
      aria-describedby={describedBy}
      aria-invalid={refused.value?.section === section && refused.value.key === form.name}
      value={shown}
      placeholder={form.required ? "needed" : ""}
      disabled={form.locked}
      onChange={(event) => {
        const text = event.currentTarget.value;
        send(text.trim() === "" ? null : typed(text, form.kind, value));
      }}
    />
  );
}

export function Field(props: FieldProps) {
  const { section, form } = props;
  const id = `set-${section}-${form.name}`;
  const wrong = refused.value?.section === section && refused.value.key === form.name;
  return (
    <div class="field">
      <label for={id}>{nameOf(form.name)}</label>
      <Input {...props} id={id} />
      <p class={wrong ? "wrong" : "help"} id={`${id}-hint`} {...(wrong ? { role: "alert" } : {})}>
        {wrong ? refused.value?.message : form.meaning}
      </p>
    </div>
  );
}
