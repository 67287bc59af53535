/** The pattern: a named one, or a table of one's own, row by row. */

import { computed, effect, signal, useSignal } from "@preact/signals";
import { change, valuesOf } from "../settings/model";
import { onMessage, scene, send } from "../state";
import { PatternTable } from "./PatternTable";
import { countDrives, fresh, fromPattern, fromTables, problems, type Row, toTables } from "./rows";

const NAMED = ["adjacent", "opposite", "skip:2", "all_pairs", "adjacent+opposite"];
const OWN = "table";

/** The rows as they are edited; null: nobody has begun, they are the skin's. */
const edited = signal<readonly Row[] | null>(null);
const pattern = signal(scene.peek()?.pattern);
const present = computed(() => (pattern.value ? fromPattern(pattern.value) : []));

onMessage("pattern", (tables) => (edited.value = fromTables(tables)));
// Another pattern of the skin: what was edited has been used, or no longer fits.
effect(() => {
  const now = scene.value?.pattern;
  if (now?.name === pattern.peek()?.name) return;
  pattern.value = now;
  edited.value = null;
});

function Editor({ own }: { readonly own: boolean }) {
  const goTo = useSignal<{ readonly row: number } | null>(null);
  const n = scene.value?.electrodes.length ?? 0;
  const rows = edited.value ?? present.value;
  const wrong = problems(rows, n);
  const at = rows.findIndex(({ id }) => wrong.has(id));
  const said = `${rows.length} rows under ${countDrives(rows)} drives`;
  const add = () => {
    edited.value = [...rows, fresh(["", "", "", ""])];
    goTo.value = { row: rows.length };
  };
  return (
    <div class="own">
      <div class="field">
        <label for="pattern-start">Start with the rows of</label>
        <select
          id="pattern-start"
          data-testid="pattern-start"
          value=""
          onChange={(event) => {
            const name = event.currentTarget.value;
            if (name === OWN) edited.value = null;
            else if (name) send({ type: "pattern", name });
            event.currentTarget.value = "";
          }}
        >
          <option value="">choose…</option>
          <option value={OWN}>the present pattern</option>
          {NAMED.map((name) => (
            <option key={name}>{name}</option>
          ))}
        </select>
      </div>
      <PatternTable rows={rows} wrong={wrong} set={(next) => (edited.value = next)} goTo={goTo.value} />
      <p class={wrong.size ? "wrong" : "help"} role="status" data-testid="pattern-said">
        {at < 0 ? said : `Row ${at + 1}: ${wrong.get(rows[at].id)}`}
        {wrong.size > 1 && ` (and ${wrong.size - 1} more)`}
      </p>
      <div class="does">
        <button type="button" data-testid="add-row" onClick={add}>
          Add a row
        </button>
        {at >= 0 && (
          <button type="button" onClick={() => (goTo.value = { row: at })}>
            Go to row {at + 1}
          </button>
        )}
        <button
          type="button"
          class="main"
          data-testid="apply-table"
          disabled={wrong.size > 0 || rows.length === 0}
          onClick={() => change("drive", { ...toTables(rows), pattern: null })}
        >
          {own ? "Use this table" : "Use this table instead"}
        </button>
      </div>
    </div>
  );
}

export function PatternEditor() {
  const values = valuesOf("drive");
  const own = Array.isArray(values.drive);
  const name = own ? OWN : String(values.pattern ?? "adjacent");
  const editing = useSignal(own);
  return (
    <>
      <div class="field">
        <label for="set-pattern">Pattern</label>
        <select
          id="set-pattern"
          data-testid="set-pattern"
          value={editing.value ? OWN : name}
          onChange={(event) => {
            const chosen = event.currentTarget.value;
            editing.value = chosen === OWN;
            edited.value = null;
            if (!editing.value) change("drive", { pattern: chosen, drive: null, measure: null });
          }}
        >
          {[...new Set([...NAMED, ...(own ? [] : [name])])].map((word) => (
            <option key={word}>{word}</option>
          ))}
          <option value={OWN}>a table of your own</option>
        </select>
        <p class="help">
          Which electrodes drive and read: {scene.value?.pattern.n_meas} measurements,{" "}
          {scene.value?.pattern.n_drive} drives. A change configures the board and takes a new reference.
        </p>
      </div>
      {editing.value && <Editor own={own} />}
    </>
  );
}
