/** The rows as a table of which only what is in sight is drawn; one row is looked at on the skin. */

import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { shownDrive, shownPair } from "../sheet/space";
import { type Cells, COLUMNS, electrode, fresh, fromText, type Row } from "./rows";

const ROW = 36;
const SHOWN = 5;
const BEYOND = 6;

export interface TableProps {
  readonly rows: readonly Row[];
  readonly wrong: ReadonlyMap<number, string>;
  readonly set: (rows: readonly Row[]) => void;
  /** A row that is to be looked at, by its place; each new object once. */
  readonly goTo: { readonly row: number } | null;
}

/** Mark a row's electrodes on the skin. */
function lookAt({ cells }: Row): void {
  const [source, sink, plus, minus] = cells.map((cell) => (electrode(cell) ?? 0) - 1);
  shownDrive.value = [source, sink];
  shownPair.value = [plus, minus];
}

export function PatternTable({ rows, wrong, set, goTo }: TableProps) {
  const box = useRef<HTMLDivElement>(null);
  const top = useSignal(0);
  const focus = useRef<readonly [number, number] | null>(null);
  const first = Math.max(0, Math.floor(top.value / ROW) - BEYOND);
  const last = Math.min(rows.length, first + SHOWN + 2 * BEYOND);

  const takeFocus = () => {
    if (!focus.current) return;
    const [row, column] = focus.current;
    const cell = box.current?.querySelector<HTMLElement>(`[data-cell="${row}-${column}"]`);
    if (!cell) return;
    focus.current = null;
    cell.focus();
  };

  /** Bring a cell into sight, and the focus into it, at once or when it is drawn. */
  const show = (row: number, column: number) => {
    const element = box.current;
    if (!element || row < 0) return;
    focus.current = [row, column];
    const low = (row + 1 - SHOWN) * ROW;
    const scroll = Math.max(low, Math.min(element.scrollTop, row * ROW));
    if (scroll !== element.scrollTop) element.scrollTop = scroll;
    top.value = scroll;
    takeFocus();
  };
  useLayoutEffect(takeFocus);
  useLayoutEffect(() => {
    if (goTo) show(goTo.row, 0);
  }, [goTo]);
  useLayoutEffect(
    () => () => {
      shownDrive.value = shownPair.value = null;
    },
    [],
  );

  const typed = (at: number, column: number, text: string) => {
    const cells = rows[at].cells.map((cell, k) => (k === column ? text : cell));
    const next = { ...rows[at], cells: cells as unknown as Cells };
    set(rows.map((row, k) => (k === at ? next : row)));
    lookAt(next);
  };
  /** Other rows, and the focus into one of them once they are drawn. */
  const become = (next: readonly Row[], at: number) => {
    focus.current = [at, 0];
    set(next);
  };
  const insert = (at: number, more: readonly Row[], without = 0) =>
    become([...rows.slice(0, at), ...more, ...rows.slice(at + without)], at);
  const onKey = (event: KeyboardEvent, at: number, column: number) => {
    const step = { ArrowDown: 1, Enter: 1, ArrowUp: -1 }[event.key];
    if (!step || !rows[at + step]) return;
    event.preventDefault();
    show(at + step, column);
  };
  const onPaste = (event: ClipboardEvent, at: number) => {
    const text = event.clipboardData?.getData("text") ?? "";
    const pasted = text.trim().includes("\n") || /\S\s+\S/.test(text) ? fromText(text) : null;
    if (!pasted) return;
    event.preventDefault();
    insert(at, pasted, rows[at].cells.every((cell) => cell === "") ? 1 : 0);
  };

  const cellOf = (row: Row, at: number, column: number) => (
    <td key={column}>
      <input
        type="text"
        inputMode="numeric"
        autocomplete="off"
        maxLength={5}
        data-cell={`${at}-${column}`}
        aria-label={`Row ${at + 1}, ${COLUMNS[column]}`}
        aria-invalid={wrong.has(row.id)}
        {...(wrong.has(row.id) ? { "aria-describedby": `row-${row.id}` } : {})}
        value={row.cells[column]}
        onFocus={() => lookAt(row)}
        onInput={(event) => typed(at, column, event.currentTarget.value)}
        onKeyDown={(event) => onKey(event, at, column)}
        onPaste={(event) => onPaste(event, at)}
      />
    </td>
  );

  return (
    <div
      ref={box}
      class="rows"
      style={{ height: `${ROW * (Math.min(SHOWN, rows.length) + 1)}px` }}
      onScroll={(event) => (top.value = event.currentTarget.scrollTop)}
    >
      <table aria-rowcount={rows.length + 1} aria-label="Rows of the pattern">
        <thead>
          <tr>
            <th scope="col">Row</th>
            {COLUMNS.map((name) => (
              <th key={name} scope="col">
                {name}
              </th>
            ))}
            <th scope="col">
              <span class="unseen">Change the row</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {first > 0 && <tr aria-hidden="true" style={{ height: `${ROW * first}px` }} />}
          {rows.slice(first, last).map((row, k) => {
            const at = first + k;
            return (
              <tr key={row.id} aria-rowindex={at + 2} data-testid="pattern-row" title={wrong.get(row.id)}>
                <th scope="row" class={wrong.has(row.id) ? "wrong" : ""} id={`row-${row.id}`}>
                  {at + 1}
                  {wrong.has(row.id) && <span class="unseen">: {wrong.get(row.id)}</span>}
                </th>
                {COLUMNS.map((_, column) => cellOf(row, at, column))}
                <td class="changes">
                  <button
                    type="button"
                    aria-label={`Duplicate row ${at + 1}`}
                    title="Duplicate"
                    onClick={() => insert(at + 1, [fresh(row.cells)])}
                  >
                    +
                  </button>
                  <button
                    type="button"
                    aria-label={`Remove row ${at + 1}`}
                    title="Remove"
                    onClick={() => become(rows.filter((other) => other !== row), Math.min(at, rows.length - 2))}
                  >
                    ×
                  </button>
                </td>
              </tr>
            );
          })}
          {last < rows.length && (
            <tr aria-hidden="true" style={{ height: `${ROW * (rows.length - last)}px` }} />
          )}
        </tbody>
      </table>
    </div>
  );
}
