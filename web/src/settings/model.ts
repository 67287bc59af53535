/** The skin's schema and settings as the server tells them, and the changes that a person makes. */

import { signal } from "@preact/signals";
import { onMessage, say, send } from "../state";
import type { Condition, KeyForm, KindForm, Progress, SectionForm, SettingRefused, Settings, Value } from "../wire";

type Values = Readonly<Record<string, Value | null>>;

export const schema = signal<readonly SectionForm[]>([]);
export const settings = signal<Settings | null>(null);
export const refused = signal<SettingRefused | null>(null);
export const progress = signal<Progress | null>(null);
/** What has been typed and is not the skin's yet, by section. */
const drafts = signal<Readonly<Record<string, Values>>>({});
/** The key that was changed last, until the change has been made. */
let asked: { readonly section: string; readonly key: string } | null = null;

onMessage("schema", ({ sections }) => (schema.value = sections));
onMessage("settings", (message) => {
  settings.value = message;
  if (!message.busy) asked = null;
  const open = refused.value?.section;
  drafts.value = open && drafts.value[open] ? { [open]: drafts.value[open] } : {};
});
onMessage("progress", (message) => (progress.value = message));
/** What only shows once the whole sheet is made names no key: it is that of the last change. */
function placed(message: SettingRefused): SettingRefused {
  if (!asked || message.key !== null || (message.section ?? asked.section) !== asked.section) return message;
  return { ...message, ...asked };
}

onMessage("settings_error", (message) => {
  refused.value = placed(message);
  if (refused.value.section === null) {
    drafts.value = {};
    say(message.message);
  }
});

const DOING = {
  mesh: "meshing",
  model: "computing the model",
  image: "preparing images",
  touches: "preparing touches",
  source: "starting the source",
} as const;

/** What a change is doing, in words. */
export function doing({ stage, done, stages }: Progress): string {
  return stage ? `${DOING[stage]}, ${done + 1} of ${stages}` : "preparing";
}

/** A section's values with what has been typed. */
export function valuesOf(section: string): Values {
  return { ...settings.value?.document[section], ...drafts.value[section] };
}

const holds = (condition: Condition | null, values: Values): boolean =>
  !condition || condition.words.includes(String(values[condition.key]));

/** Whether a key applies beside the section's other values. */
export function applies(key: KeyForm, values: Values): boolean {
  if (key.unless && values[key.unless] != null) return false;
  return holds(key.when, values) && holds(key.effective, values);
}

/** Ask for a value; null takes the key out. What does not stand beside it any more goes. */
export function change(section: string, values: Values): void {
  const draft = { ...drafts.value[section], ...values };
  drafts.value = { ...drafts.value, [section]: draft };
  refused.value = null;
  asked = { section, key: Object.keys(values)[0] };
  send({ type: "settings", changes: { [section]: draft } });
}

/** Forget what has been typed in a section. */
export function discard(section: string): void {
  const { [section]: _, ...rest } = drafts.value;
  drafts.value = rest;
  refused.value = null;
}

function step(type: "undo" | "redo"): void {
  asked = null;
  send({ type });
}
export const undo = (): void => step("undo");
export const redo = (): void => step("redo");

const WAIT_MS = 60;
let waiting: (() => void) | null = null;

/** Run the newest of many calls, at most so often: a slider moves faster than pictures are made. */
export function soon(work: () => void): void {
  const idle = waiting === null;
  waiting = work;
  if (!idle) return;
  window.setTimeout(() => {
    const run = waiting;
    waiting = null;
    run?.();
  }, WAIT_MS);
}

/** A quantity in two: the number, and the unit that it has or gets; else as it is. */
export function parted(value: Value | null | undefined, kind: KindForm): readonly [text: string, unit: string] {
  const text = Array.isArray(value) ? value.join(", ") : String(value ?? "");
  if (kind.form !== "quantity") return [text, ""];
  const found = /^\s*([-+.\deE]+)\s+(\S+)\s*$/.exec(text);
  return found ? [found[1], found[2]] : [text, kind.unit ?? ""];
}

/** What a person typed, as the skin file writes it: a bare number gets the unit that was there. */
export function typed(text: string, kind: KindForm, before: Value | null | undefined): Value {
  const trimmed = text.trim();
  if (kind.form === "number" && trimmed !== "" && Number.isFinite(Number(trimmed))) return Number(trimmed);
  if (kind.form === "quantity" && trimmed !== "" && Number.isFinite(Number(trimmed))) {
    return `${trimmed} ${parted(before, kind)[1]}`;
  }
  return trimmed;
}
