/** The settings drawer: the skin's sections as forms, undo, and skin files. */

import { useSignal } from "@preact/signals";
import { addDrawer } from "../drawers";
import { PatternEditor } from "../pattern/PatternEditor";
import { say, send } from "../state";
import { Field, nameOf } from "./Field";
import {
  discard,
  doing,
  progress,
  redo,
  refused,
  schema,
  type SectionForm,
  settings,
  stands,
  undo,
  valuesOf,
} from "./model";
import { Alpha, Threshold } from "./Slider";

/** What is changed most stands first; in words. */
const ORDER: Readonly<Record<string, string>> = {
  inverse: "Picture",
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

function Section({ section }: { readonly section: SectionForm }) {
  const values = valuesOf(section.name);
  const { name } = section;
  const refusal = refused.value?.section === name ? refused.value : null;
  return (
    <details open={name === "inverse"} data-testid={`section-${name}`}>
      <summary title={section.meaning}>{ORDER[name]}</summary>
      {name === "drive" && <PatternEditor />}
      {section.keys
        .filter((key) => stands(key, values) && key.kind.form !== "rows" && !TABLE.has(key.name))
        .map((key) => {
          const value = values[key.name];
          if (name === "inverse" && key.name === "alpha") return <Alpha key="alpha" value={value} />;
          if (SLIDERS.has(key.name)) return <Threshold key={key.name} form={key} value={value} />;
          return <Field key={key.name} section={name} form={key} value={value} />;
        })}
      {refusal && (
        <p class="wrong" role="alert" data-testid="refused">
          {refusal.key ? `${nameOf(refusal.key)}: ` : ""}
          {refusal.message}{" "}
          <button type="button" onClick={() => discard(name)}>
            Leave it as it was
          </button>
        </p>
      )}
    </details>
  );
}

/** Save under a name, load what is there. */
function Files() {
  const name = useSignal("");
  const again = useSignal("");
  const files = settings.value?.files ?? [];
  const builtin = settings.value?.builtin ?? [];
  const save = () => {
    const wanted = name.value.trim();
    if (!/^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$/.test(wanted)) {
      say("A name has letters, digits, - and _ only");
      return;
    }
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
  const ordered = Object.keys(ORDER).flatMap((name) => schema.value.find((s) => s.name === name) ?? []);
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
        <p class="wrong" role="alert">
          {refused.value.message}
        </p>
      )}
      {ordered.map((section) => (
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
