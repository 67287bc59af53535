/** The drawer that sets a skin up: the board, the reference, the wires, the touch. */

import { signal } from "@preact/signals";
import { takeReference } from "../commands";
import { addDrawer, whenOpened } from "../drawers";
import { duration, millimetres } from "../format";
import { send, status } from "../state";
import { askFiles, askSources, files, flow, type FlowKind, type Phase, sources } from "./model";

type Step = "board" | FlowKind;
const STEPS: readonly (readonly [Step, string])[] = [
  ["board", "1 Board"],
  ["wiring", "2 Wiring"],
  ["touch", "3 Touch"],
];
const step = signal<Step>("board");
const names: Readonly<Record<FlowKind, ReturnType<typeof signal<string>>>> = {
  wiring: signal("wired"),
  touch: signal("touch"),
};

function Identity() {
  const found = sources.value;
  const board = found?.board;
  if (!found || !board) return <p class="hint">The board has not reported what it is yet.</p>;
  return (
    <dl class="identity" data-testid="board">
      <dt>Firmware</dt>
      <dd>{board.firmware}</dd>
      <dt>Protocol</dt>
      <dd>
        {board.protocol}
        {board.protocol !== found.host_protocol && ` (this program: ${found.host_protocol}, understands both)`}
      </dd>
      <dt>Electrodes</dt>
      <dd>{board.channels}</dd>
      <dt>Converter</dt>
      <dd>{board.adc_bits} bits</dd>
      <dt>Current</dt>
      <dd>{board.current_ma} mA</dd>
      <dt>Serial number</dt>
      <dd>{/^0*$/.test(board.unique_id) ? "none" : board.unique_id}</dd>
    </dl>
  );
}

function Reference() {
  const now = status.value;
  if (!now) return null;
  const { ready, frames, needed, age_s: age } = now.reference;
  const stale = now.baseline?.stale;
  return (
    <>
      <h3>Reference</h3>
      <p data-testid="reference-words">
        {!ready
          ? `Taking the reference, ${frames} of ${needed} frames: keep hands off the skin.`
          : stale
            ? `Stale: ${stale}. Take your hands off the skin, then take the reference again.`
            : `Taken ${duration(age ?? 0)} ago. Images show what has changed since then.`}
      </p>
      {!ready && <progress value={frames} max={needed} aria-label="Reference" />}
      <button type="button" disabled={!ready} onClick={takeReference.run} data-testid="take-reference">
        Take the reference, hands off <kbd>R</kbd>
      </button>
    </>
  );
}

function Board() {
  const found = sources.value;
  return (
    <>
      <p class="hint">Where do the frames come from?</p>
      <ul class="filed" data-testid="sources">
        {found?.sources.map(({ id, text }) => (
          <li key={id} class={id === found.current ? "current" : ""}>
            <div>
              <strong>{text}</strong>
              <span class="small">{id}</span>
            </div>
            <div class="does">
              <button
                type="button"
                aria-label={id === found.current ? `${text}: reconnect` : `Connect ${text}`}
                onClick={() => send({ type: "connect", source: id })}
              >
                {id === found.current ? "Reconnect" : "Connect"}
              </button>
            </div>
          </li>
        ))}
      </ul>
      {found && !found.sources.some(({ id }) => id.startsWith("serial:")) && (
        <p class="hint">No serial port is connected: plug the board in, and it appears here.</p>
      )}
      {status.value?.problem && (
        <p class="wrong" role="alert">
          {status.value.problem}
        </p>
      )}
      <Identity />
      <Reference />
    </>
  );
}

const TEACHING: Readonly<Record<FlowKind, string>> = {
  wiring:
    "This finds which wire ends at which electrode. Press the skin where the dot is, a few times. The answer is saved as a skin file.",
  touch:
    "This teaches the skin where a touch is. Press where the dot is, softly and hard in turn, ten times or more. Positions then come from these presses, each with its uncertainty.",
};

const PHASES: Readonly<Record<Phase, string>> = {
  rest: "Hands off",
  press: "Press where the dot is",
  hold: "Hold still",
  release: "Recorded. Let go",
};

function Going({ kind }: { kind: FlowKind }) {
  const { phase = "rest", effort, presses = [], text, ready, thinking, figures } = flow.value;
  const taken = `${presses.length} press${presses.length === 1 ? "" : "es"} recorded`;
  const doubtful = figures?.doubtful ?? [];
  const name = names[kind];
  return (
    <>
      <p class="lead" role="status" data-testid="phase">
        {phase === "press" && effort ? `Press ${effort} where the dot is` : PHASES[phase]}
      </p>
      <p data-testid="taken">
        {taken}
        {thinking ? ", computing…" : ""}
      </p>
      <p data-testid="flow-text">{text}</p>
      {kind === "wiring" && figures?.probability !== undefined && (
        <progress value={figures.probability} max={1} aria-label="How sure the answer is" />
      )}
      {doubtful.length > 0 && (
        <p class="wrong">
          {doubtful.length === 1 ? "Press " : "Presses "}
          {doubtful.map((row) => row + 1).join(", ")} do not fit the others: the position may be wrong.
        </p>
      )}
      <ol class="presses" aria-label="Presses recorded">
        {presses.map(([x, y], k) => (
          <li key={k} class={doubtful.includes(k) ? "doubtful" : ""}>
            x {millimetres(x, 0)}, y {millimetres(y, 0)} mm
            {figures?.errors_mm?.[k] !== undefined && (
              <span class="small"> missed by {figures.errors_mm[k].toFixed(0)} mm</span>
            )}
          </li>
        ))}
      </ol>
      <div class="does">
        <button
          type="button"
          data-testid="flow-undo"
          disabled={presses.length === 0}
          onClick={() => send({ type: "flow_undo" })}
        >
          Undo the last press
        </button>
        <button type="button" data-testid="flow-end" onClick={() => send({ type: "flow_end" })}>
          Leave
        </button>
      </div>
      <form
        class="row"
        onSubmit={(event) => {
          event.preventDefault();
          send({ type: "flow_keep", name: name.value });
        }}
      >
        <label class="unseen" for="keep-name">
          Name of the file
        </label>
        <input
          id="keep-name"
          type="text"
          pattern="[A-Za-z0-9][A-Za-z0-9_\-]{0,63}"
          required
          value={name.value}
          onInput={({ currentTarget }) => (name.value = currentTarget.value)}
        />
        <button type="submit" class="main" data-testid="flow-keep" disabled={!ready}>
          Save and use
        </button>
      </form>
    </>
  );
}

function Guided({ kind }: { kind: FlowKind }) {
  if (flow.value.kind === kind) return <Going kind={kind} />;
  return (
    <>
      <p>{TEACHING[kind]}</p>
      <button
        type="button"
        class="main"
        data-testid="flow-begin"
        disabled={status.value?.replay != null}
        onClick={() => send({ type: "flow_begin", kind })}
      >
        Begin
      </button>
      {status.value?.replay && <p class="hint">A recording cannot be pressed: go back to live first.</p>}
    </>
  );
}

function Calibration() {
  const known = flow.value.calibration;
  const kept = (files.value?.files ?? []).filter(({ name }) => name.endsWith(".npz"));
  if (flow.value.kind === "touch") return null;
  return (
    <>
      <h3>In use</h3>
      <p data-testid="calibration">
        {known === null
          ? "Positions of touches come from the voltages and the model of the skin."
          : `Positions of touches come from ${known || "the calibration that tomoskin was started with"}.`}
      </p>
      {(kept.length > 0 || known !== null) && (
        <label class="row">
          <span>Calibration</span>
          <select
            value={known ?? ""}
            onChange={({ currentTarget: { value } }) =>
              send({ type: "calibration", name: value || null })
            }
          >
            <option value="">none</option>
            {kept.map(({ name }) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
      )}
    </>
  );
}

function View() {
  const shown = step.value;
  return (
    <div class="flow">
      <div class="steps" role="group" aria-label="Steps">
        {STEPS.map(([id, label]) => (
          <button
            key={id}
            type="button"
            data-testid={`step-${id}`}
            aria-pressed={shown === id}
            onClick={() => (step.value = id)}
          >
            {label}
          </button>
        ))}
      </div>
      {shown === "board" ? <Board /> : <Guided kind={shown} />}
      {shown === "touch" && <Calibration />}
    </div>
  );
}

addDrawer({ id: "setup", label: "Set up", key: "U", title: "Board, reference, wiring, touch", View });

const OFTEN = 2000;
let timer = 0;
whenOpened("setup", () => {
  const ask = () => {
    askSources();
    askFiles();
  };
  ask();
  window.clearInterval(timer);
  timer = window.setInterval(() => {
    if (document.querySelector("[data-testid=drawer-setup]")) ask();
    else window.clearInterval(timer);
  }, OFTEN);
});
