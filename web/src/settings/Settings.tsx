/** The settings drawer: the skin's sections as forms, undo, and skin files. */

import { useSignal } from "@preact/signals";
import { addDrawer } from "../drawers";
import { nameProblem } from "../flows/format";
import { PatternEditor } from "../pattern/PatternEditor";
import { say, scene, send } from "../state";
import { Field, isRefused, Refusal } from "./Field";
import {
  applies,
  doing,
  progress,
  redo,
  refused,
  schema,
  settings,
  undo,
  valuesOf,
} from "./model";
import { Alpha, Threshold } from "./Slider";
import type { KeyForm, SectionForm } from "../wire";

/** What is changed most stands first; in words. */
const ORDER: Readonly<Record<string, string>> = {
  inverse: "Image",
  touch: "Touches",
  drive: "Drive and measurement",
  electrodes: "Electrodes",
  outline: "Outline",
  material: "Material",
  mesh: "Mesh",
  readout: "Read-out and averaging",
  signal: "Drift",
  surface: "Surface",
  twin: "Twin",
};
const SLIDERS = new Set(["gamma1", "gamma2"]);
const TABLE = new Set(["pattern", "drive", "measure"]);

/** The keys that have a field now: those that apply, and can be typed. */
function fields(section: SectionForm): readonly KeyForm[] {
  const values = valuesOf(section.name);
  return section.keys.filter(
    (key) => applies(key, values) && key.kind.form !== "rows" && !TABLE.has(key.name),
  );
}

function Setting({ section, form }: { readonly section: string; readonly form: KeyForm }) {
  const value = valuesOf(section)[form.name];
  if (form.name === "alpha") return <Alpha value={value} />;
  if (SLIDERS.has(form.name)) return <Threshold form={form} value={value} />;
  return <Field section={section} form={form} value={value} />;
}

function Section({ section }: { readonly section: SectionForm }) {
  const { name } = section;
  const shown = fields(section);
  // What has no field of its own, as a table, is refused below them all.
  const elsewhere = refused.value?.section === name && !shown.some((key) => isRefused(name, key.name));
  return (
    <details open={name === "inverse"} data-testid={`section-${name}`}>
      <summary title={section.meaning}>{ORDER[name]}</summary>
      {name === "drive" && <PatternEditor />}
      {shown.map((form) => (
        <Setting key={form.name} section={name} form={form} />
      ))}
      {elsewhere && <Refusal section={name} id={`wrong-${name}`} />}
    </details>
  );
}

/** The sections that this source has a use for. */
function offered(): readonly SectionForm[] {
  const simulated = scene.value?.pressable ?? false;
  const names = Object.keys(ORDER).filter((name) => name !== "twin" || simulated);
  return names.flatMap((name) => schema.value.find((section) => section.name === name) ?? []);
}

/** Save under a name, load what is there. */
function Files() {
  const name = useSignal("");
  const again = useSignal("");
  const files = settings.value?.files ?? [];
  const builtin = settings.value?.builtin ?? [];
  const save = () => {
    const wanted = name.value.trim();
    const problem = nameProblem(wanted);
    if (problem) return say(problem);
    send({ type: "save_skin", name: wanted, replace: again.value === wanted });
    again.value = files.includes(wanted) ? wanted : "";
  };
  return (
    <div class="files">
      <label class="unseen" for="skin-name">
        Name of the skin file
      </label>
      <input
        id="skin-name"
        data-testid="skin-name"
        type="text"
        placeholder="name"
        autocomplete="off"
        value={name.value}
        onInput={(event) => (name.value = event.currentTarget.value)}
      />
      <button type="button" data-testid="skin-save" onClick={save}>
        {again.value && again.value === name.value ? "Replace" : "Save"}
      </button>
      <label class="unseen" for="skin-load">
        Load a skin
      </label>
      <select
        id="skin-load"
        data-testid="skin-load"
        value=""
        onChange={(event) => {
          const { value } = event.currentTarget;
          if (value) send({ type: "load_skin", name: value });
          event.currentTarget.value = "";
        }}
      >
        <option value="">Load…</option>
        {[...files, ...builtin.filter((word) => !files.includes(word))].map((word) => (
          <option key={word}>{word}</option>
        ))}
      </select>
    </div>
  );
}

function View() {
  const now = settings.value;
  if (!now) return <p class="hint">Waiting for the settings</p>;
  const took = now.took_ms === null ? "" : `ready in ${now.took_ms.toFixed(0)} ms`;
  return (
    <div class="settings">
      <div class="doing">
        <button type="button" data-testid="undo" disabled={!now.undo} onClick={undo}>
          Undo
        </button>
        <button type="button" data-testid="redo" disabled={!now.redo} onClick={redo}>
          Redo
        </button>
        <span class="took" data-testid="took" role="status">
          {now.busy ? (progress.value ? doing(progress.value) : "preparing") : took}
        </span>
      </div>
      {refused.value && refused.value.section === null && (
        <p class="wrong" role="alert" data-testid="refused">
          {refused.value.message}
        </p>
      )}
      {offered().map((section) => (
        <Section key={section.name} section={section} />
      ))}
      <Files />
    </div>
  );
}

addDrawer({
  id: "settings",
  label: "Settings",
  key: "E",
  title: "Change the skin's settings while it runs",
  View,
});
