/** The drawer of the session folder: what was recorded, played again, taken along. */

import { signal } from "@preact/signals";
import { addDrawer, whenOpened } from "../drawers";
import { send, status } from "../state";
import { bytes, day } from "./format";
import { askFiles, exported, files, flow, type FoundFile } from "./model";

const FORMATS: readonly (readonly [string, string])[] = [
  ["touches", "Touches (CSV)"],
  ["csv", "Voltages (CSV)"],
  ["npz", "Numbers (NPZ)"],
  ["mat", "EIDORS (MAT)"],
  ["h5", "Everything (HDF5)"],
  ["parquet", "Voltages (Parquet)"],
  ["png", "Maps (PNG)"],
  ["gif", "Film (GIF)"],
];

const chosen = signal<string>("touches");

function Download({ name }: { name: string }) {
  return (
    <a class="button" href={`./files/${encodeURIComponent(name)}`} download={name} data-testid={`get-${name}`}>
      Download
    </a>
  );
}

function Session({ file }: { file: FoundFile }) {
  const playing = files.value?.playing === file.name;
  const busy = files.value?.recording === file.name;
  return (
    <li class={playing ? "current" : ""} data-testid="session">
      <div>
        <strong>{file.name}</strong>
        <span class="small">
          {busy ? "being recorded" : playing ? "being played" : `${day(file.written)}, ${bytes(file.size)}`}
        </span>
      </div>
      <div class="does">
        <button type="button" disabled={busy} onClick={() => send({ type: "open", name: file.name })}>
          Play
        </button>
        <button
          type="button"
          disabled={busy || files.value?.exporting != null}
          onClick={() => send({ type: "export", name: file.name, format: chosen.value })}
        >
          Export
        </button>
        {!busy && <Download name={file.name} />}
      </div>
    </li>
  );
}

function Other({ file }: { file: FoundFile }) {
  const calibration = flow.value.calibration === file.name;
  return (
    <li class={exported.value === file.name || calibration ? "current" : ""}>
      <div>
        <strong>{file.name}</strong>
        <span class="small">
          {calibration ? "gives the places of touches" : `${file.kind}, ${bytes(file.size)}`}
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
          onChange={({ currentTarget }) => (chosen.value = currentTarget.value)}
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
        <p class="hint">Nothing has been recorded here yet: press Record below, then touch the skin.</p>
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

addDrawer({ id: "sessions", label: "Sessions", key: "S", title: "Recordings: play, export, download", View });

const OFTEN = 1000;
let timer = 0;
whenOpened("sessions", () => {
  askFiles();
  window.clearInterval(timer);
  timer = window.setInterval(() => {
    if (document.querySelector("[data-testid=drawer-sessions]")) askFiles();
    else window.clearInterval(timer);
  }, OFTEN);
});
