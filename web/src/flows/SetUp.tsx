/** The drawer that sets a skin up: the board, the reference, the wires, the touch, force and depth. */

import { useEffect } from "preact/hooks";
import { takeReference } from "../commands";
import { addDrawer, whileOpened } from "../drawers";
import { duration, millimetres } from "../format";
import { narrow } from "../screen";
import { send, status } from "../state";
import type { FlowNow } from "../wire";
import { Amount } from "./Amount";
import { InUse } from "./Calibrations";
import { Keep, Leave } from "./Keep";
import { askFiles, askSources, flow, type Phase, sources, type Step, step, stepOf } from "./model";
import { Rub } from "./Rub";

const STEPS: readonly (readonly [Step, string])[] = [
  ["board", "1 Board"],
  ["mapping", "2 Channels"],
  ["touch", "3 Touch"],
  ["force", "4 Force"],
  ["depth", "5 Depth"],
];

function Identity() {
  const found = sources.value;
  const board = found?.board;
  if (!found || !board) return <p class="hint">The board has not reported what it is yet.</p>;
  return (
    <dl class="identity" data-testid="board">
      {board.name !== "" && (
        <>
          <dt>Board</dt>
          <dd>{board.name}</dd>
        </>
      )}
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

interface Teaching {
  readonly kind: string;
  readonly text: string;
  readonly begin: string;
}

const TEACHING: Readonly<Record<Exclude<Step, "board">, readonly Teaching[]>> = {
  mapping: [
    {
      kind: "mapping",
      text: "This finds the channel mapping: which wire ends at which electrode. Press the skin where the dot is, a few times. The answer is saved as a skin file.",
      begin: "Begin",
    },
  ],
  touch: [
    {
      kind: "touch",
      text: "Press where the dot is, softly and hard in turn, ten times or more. Positions then come from them, with their uncertainty.",
      begin: "Begin",
    },
    {
      kind: "rub",
      text: "Or rub all of the skin with one finger for a minute: no position need be known.",
      begin: "Rub the skin",
    },
  ],
  force: [
    {
      kind: "force",
      text: "This teaches the skin what touches weigh. Lay known weights on it, one at a time, ten times or more, light and heavy, at many spots. Use one tip for all: a larger one changes the sheet otherwise.",
      begin: "Begin",
    },
  ],
  depth: [
    {
      kind: "depth",
      text: "This teaches the skin how deep touches are. Press it to known depths with a stand, one at a time, ten times or more, shallow and deep, at many spots. Depths count from where the tip just touches. Use tips such as will press later.",
      begin: "Begin",
    },
  ],
};

const PHASES: Partial<Record<Phase, string>> = {
  rest: "Hands off",
  press: "Press where the dot is",
  hold: "Hold still",
  release: "Recorded. Let go",
};

/** What is to be done now. */
function lead({ phase, effort, ready, paused }: FlowNow): string | undefined {
  if (paused) return "Paused while a recording is played";
  if (phase !== "press") return PHASES[phase];
  if (effort) return `Press ${effort} where the dot is`;
  return ready ? "Save it, or press where the dot is" : PHASES.press;
}

function Going({ kind }: { kind: string }) {
  const { presses, text, thinking, figures } = flow.value;
  const taken = `${presses.length} press${presses.length === 1 ? "" : "es"} recorded`;
  const doubtful = figures.doubtful ?? [];
  return (
    <>
      <p class="lead" role="status" data-testid="phase">
        {lead(flow.value)}
      </p>
      <p data-testid="taken">
        {taken}
        {thinking ? ", computing…" : ""}
      </p>
      <div class="does">
        <button
          type="button"
          data-testid="flow-undo"
          disabled={presses.length === 0}
          onClick={() => send({ type: "flow_delete" })}
        >
          Undo the last press
        </button>
        <Leave />
      </div>
      <Keep kind={kind} />
      <p data-testid="flow-text">{text}</p>
      {kind === "mapping" && figures.probability !== undefined && (
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
            {figures.errors_mm?.[k] !== undefined && (
              <span class="small"> missed by {figures.errors_mm[k].toFixed(0)} mm</span>
            )}
          </li>
        ))}
      </ol>
    </>
  );
}

/** The flow that goes on, where it belongs to this step. */
function Guided({ kinds }: { kinds: readonly Teaching[] }) {
  const kind = flow.value.kind;
  if ((kind === "force" || kind === "depth") && kinds[0].kind === kind) return <Amount kind={kind} />;
  if (kind === "rub" && kinds.some((each) => each.kind === kind)) return <Rub />;
  if (kind && kinds.some((each) => each.kind === kind)) return <Going kind={kind} />;
  return (
    <>
      {kinds.filter(({ kind }) => flow.value.offered.includes(kind)).map(({ kind, text, begin }) => (
        <div key={kind} class="teaches">
          <p>{text}</p>
          <button
            type="button"
            class={kind === kinds[0].kind ? "main" : ""}
            data-testid={kind === kinds[0].kind ? "flow-begin" : `flow-begin-${kind}`}
            disabled={status.value?.replay != null}
            onClick={() => send({ type: "flow_begin", kind })}
          >
            {begin}
          </button>
        </div>
      ))}
      {status.value?.replay && <p class="hint">Presses need a live source: go back to live first.</p>}
    </>
  );
}

function View() {
  const shown = step.value;
  const going = flow.value.kind && stepOf(flow.value.kind);
  useEffect(() => {
    // What is to be done stands at the top.
    const drawer = document.getElementById("drawer");
    drawer?.querySelector(".drawn")?.scrollTo(0, 0);
    if (narrow.peek()) drawer?.scrollIntoView();
  }, [shown, going]);
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
      {shown !== "board" && shown !== "mapping" && going !== shown && <InUse of={shown} />}
      {shown === "board" ? <Board /> : <Guided kinds={TEACHING[shown]} />}
    </div>
  );
}

addDrawer({ id: "setup", label: "Set up", key: "U", title: "Board, reference, channel mapping, touch, force, depth", View });

whileOpened("setup", 2000, () => {
  askSources();
  askFiles();
});
whileOpened("setup", null, () => {
  const { kind } = flow.peek();
  if (kind) step.value = stepOf(kind);
});
