/** The drawer of the session folder: what was recorded, played again, taken along. */

import { signal, useSignal } from "@preact/signals";
import { addDrawer, whileOpened } from "../drawers";
import { send, status } from "../state";
import { bytes, day, nameProblem } from "./format";
import type { ExportSession, FileEntry } from "../wire";
import { askFiles, calibrations, exported, files, opening } from "./model";

type Format = ExportSession["format"];

const FORMATS: readonly (readonly [Format, string])[] = [
  ["touches", "Touches (CSV)"],
  ["csv", "Voltages (CSV)"],
  ["npz", "Numbers (NPZ)"],
  ["mat", "EIDORS (MAT)"],
  ["h5", "Everything (HDF5)"],
  ["parquet", "Voltages (Parquet)"],
  ["png", "Maps (PNG)"],
  ["gif", "Film (GIF)"],
];

const chosen = signal<Format>("touches");

function Download({ name }: { name: string }) {
  return (
    <a class="button" href={`./files/${encodeURIComponent(name)}`} download={name} data-testid={`get-${name}`}>
      Download
    </a>
  );
}

const stemOf = (name: string): string => name.replace(/\.[^.]*$/, "");

/** The session that is being changed, and whether its deletion has been asked for once. */
const changing = signal<string | null>(null);
const doomed = signal(false);

function change(name: string | null): void {
  changing.value = name;
  doomed.value = false;
  // The form goes, and with it what had the focus.
  if (name === null) document.getElementById("drawer")?.focus();
}

/** Another name, notes, deletion; what is in use keeps its name. */
function Change({ file, busy }: { file: FileEntry; busy: boolean }) {
  const { name } = file;
  const to = useSignal(stemOf(name));
  const notes = useSignal(file.notes);
  const id = `of-${stemOf(name)}`;
  const problem = nameProblem(to.value);
  return (
    <div class="changing" data-testid="session-change">
      <form
        class="row"
        onSubmit={(event) => {
          event.preventDefault();
          if (to.value !== stemOf(name)) send({ type: "rename", name, to: to.value });
          change(null);
        }}
      >
        <label for={`name-${id}`}>Name</label>
        <input
          id={`name-${id}`}
          data-testid="session-name"
          type="text"
          autocomplete="off"
          disabled={busy}
          value={to.value}
          onInput={({ currentTarget }) => (to.value = currentTarget.value)}
        />
        <button type="submit" disabled={busy || problem !== null}>
          Rename
        </button>
        {problem && (
          <p class="wrong" role="alert" data-testid="name-problem">
            {problem}
          </p>
        )}
      </form>
      <form
        class="row"
        onSubmit={(event) => {
          event.preventDefault();
          send({ type: "annotate", name, text: notes.value });
          change(null);
        }}
      >
        <label for={`notes-${id}`}>Notes</label>
        <textarea
          id={`notes-${id}`}
          data-testid="session-notes"
          rows={3}
          maxLength={4000}
          value={notes.value}
          onInput={({ currentTarget }) => (notes.value = currentTarget.value)}
        />
        <button type="submit">Save notes</button>
      </form>
      <div class="does">
        <button
          type="button"
          data-testid="session-delete"
          disabled={busy}
          onClick={() => {
            if (doomed.value) {
              send({ type: "delete", name });
              change(null);
            } else doomed.value = true;
          }}
        >
          {doomed.value ? "Delete for good" : "Delete"}
        </button>
        {busy && <span class="small">in use: it keeps its name</span>}
      </div>
    </div>
  );
}

function aboutOf(file: FileEntry): string {
  if (files.value?.recording === file.name) return "being recorded";
  if (files.value?.playing === file.name) return "being played";
  return `${day(file.written)}, ${bytes(file.size)}`;
}

function Session({ file }: { file: FileEntry }) {
  const { name } = file;
  const playing = files.value?.playing === name;
  const recorded = files.value?.recording === name;
  const open = changing.value === name;
  return (
    <li class={playing ? "current" : ""} data-testid="session">
      <div>
        <strong>{name}</strong>
        <span class="small">{aboutOf(file)}</span>
        {file.notes && <p class="noted">{file.notes}</p>}
      </div>
      <div class="does">
        <button
          type="button"
          disabled={recorded}
          onClick={() => {
            opening.value = name;
            send({ type: "open", name });
          }}
        >
          Play
        </button>
        <button
          type="button"
          disabled={recorded || files.value?.exporting != null}
          onClick={() => send({ type: "export", name, format: chosen.value })}
        >
          Export
        </button>
        {!recorded && <Download name={name} />}
        <button
          type="button"
          aria-expanded={open}
          aria-label={`Name and notes of ${name}`}
          onClick={() => change(open ? null : name)}
        >
          Edit
        </button>
      </div>
      {open && <Change file={file} busy={playing || recorded || files.value?.exporting === name} />}
    </li>
  );
}

function Other({ file }: { file: FileEntry }) {
  const { touch, force, depth } = calibrations.value;
  const names = { positions: touch, forces: force, depths: depth };
  const gives = Object.entries(names).find(([, name]) => name === file.name)?.[0];
  return (
    <li class={exported.value === file.name || gives ? "current" : ""}>
      <div>
        <strong>{file.name}</strong>
        <span class="small">
          {gives ? `gives the ${gives} of touches` : `${file.kind}, ${bytes(file.size)}`}
        </span>
      </div>
      <div class="does">
        <Download name={file.name} />
      </div>
    </li>
  );
}

function View() {
  const found = files.value?.files ?? [];
  const sessions = found.filter(({ kind }) => kind === "session");
  const others = found.filter(({ kind }) => kind !== "session");
  const { exporting = null, share = 0, others: unlisted = 0 } = files.value ?? {};
  return (
    <div class="flow">
      {status.value?.replay && (
        <button type="button" class="main" data-testid="go-live" onClick={() => send({ type: "live" })}>
          Back to live
        </button>
      )}
      <label class="row">
        <span>Export as</span>
        <select
          data-testid="format"
          value={chosen.value}
          onChange={({ currentTarget }) => (chosen.value = currentTarget.value as Format)}
        >
          {FORMATS.map(([id, name]) => (
            <option key={id} value={id}>
              {name}
            </option>
          ))}
        </select>
      </label>
      {exporting && (
        <p role="status">
          Exporting {exporting}
          <progress value={share} max={1} aria-label="Export" />
        </p>
      )}
      {sessions.length === 0 && (
        <p class="hint">Nothing has been recorded yet. Press Record, then touch the skin.</p>
      )}
      <ul class="filed">
        {sessions.map((file) => (
          <Session key={file.name} file={file} />
        ))}
      </ul>
      {others.length > 0 && <h3>Other files</h3>}
      <ul class="filed">
        {others.map((file) => (
          <Other key={file.name} file={file} />
        ))}
      </ul>
      {unlisted > 0 && (
        <p class="hint" data-testid="unlisted">
          {unlisted} more not listed: only the newest 200, with names of letters, digits, dot, dash and underscore, are.
        </p>
      )}
    </div>
  );
}

addDrawer({ id: "sessions", label: "Sessions", key: "S", title: "Recordings: play, export, download, rename, delete, write notes", View });

whileOpened("sessions", 1000, askFiles);
