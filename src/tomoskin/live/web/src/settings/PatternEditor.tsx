/** The pattern: a named one, or a table of one's own, row by row. */

import { useSignal } from "@preact/signals";
import { scene } from "../state";
import { change, presentTable, readTable, valuesOf } from "./model";

const NAMED = ["adjacent", "opposite", "skip:2", "all_pairs", "adjacent+opposite"];
const OWN = "table";

export function PatternEditor() {
  const values = valuesOf("drive");
  const own = Array.isArray(values.drive);
  const name = own ? OWN : String(values.pattern ?? "adjacent");
  const editing = useSignal(own);
  const text = useSignal<string | null>(null);
  const shown = text.value ?? presentTable.value;
  const table = readTable(shown);
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
            text.value = null;
            if (!editing.value) change("drive", { pattern: chosen, drive: null, measure: null });
          }}
        >
          {[...new Set([...NAMED, ...(own ? [] : [name])])].map((word) => (
            <option key={word}>{word}</option>
          ))}
          <option value={OWN}>a table of your own</option>
        </select>
        <p class="help">
          Where current flows and what is read: {scene.value?.pattern.n_meas} rows,{" "}
          {scene.value?.pattern.n_drive} drives. The board is set to it, and the reference taken anew.
        </p>
      </div>
      {editing.value && (
        <div class="field table">
          <label for="set-table">Source, sink, plus, minus: electrodes from 1, one row a line</label>
          <textarea
            id="set-table"
            data-testid="set-table"
            rows={8}
            spellcheck={false}
            aria-invalid={!table}
            value={shown}
            onInput={(event) => (text.value = event.currentTarget.value)}
          />
          <p class={table ? "help" : "wrong"}>
            {table ? `${table.drive.length} rows` : "Expected four whole numbers in every line"}
          </p>
          <button
            type="button"
            data-testid="apply-table"
            disabled={!table}
            onClick={() => table && change("drive", { ...table, pattern: null })}
          >
            Use this table
          </button>
        </div>
      )}
    </>
  );
}
