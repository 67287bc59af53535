/** Touch learnt from rubbing: how much there is, known positions beside it, what it tells. */

import { send } from "../state";
import { Keep, Leave, Remarks } from "./Keep";
import { flow, type Phase } from "./model";

const PHASES: Partial<Record<Phase, string>> = {
  rub: "Rub everywhere with one finger",
  rest: "Hands off",
  press: "Press where the dot is",
  hold: "Hold still",
  release: "Recorded. Let go",
};

/** Known positions: none is needed, five help. */
function Points({ on, count }: { on: boolean; count: number }) {
  return (
    <div class="does">
      <button
        type="button"
        data-testid="flow-point"
        aria-pressed={on}
        title="Five presses at known positions make the result better"
        onClick={() => send({ type: "flow_point", on: !on })}
      >
        {on ? "Go on rubbing" : "Press known positions"}
      </button>
      {count > 0 && (
        <button type="button" onClick={() => send({ type: "flow_delete" })}>
          Undo position {count}
        </button>
      )}
    </div>
  );
}

function Learn({ needed, thinking }: { needed: number; thinking: boolean }) {
  if (thinking) {
    return (
      <div class="does">
        <span data-testid="flow-stage">{flow.value.stage || "learning"}</span>
        <button type="button" data-testid="flow-stop" onClick={() => send({ type: "flow_stop" })}>
          Cancel
        </button>
      </div>
    );
  }
  return (
    <div class="does">
      <button
        type="button"
        class="main"
        data-testid="flow-learn"
        disabled={needed > 0}
        onClick={() => send({ type: "flow_learn" })}
      >
        Learn
      </button>
      <Leave />
    </div>
  );
}

export function Rub() {
  const { phase, presses, rubbed, text, thinking, dot, ready, paused } = flow.value;
  if (!rubbed) return null;
  const { touches, needed } = rubbed;
  return (
    <>
      <p class="lead" role="status" data-testid="phase">
        {paused ? "Paused while a recording is played" : PHASES[phase]}
      </p>
      <progress
        value={Math.min(touches, needed)}
        max={needed}
        aria-label="Touches, of those that are needed"
      />
      <p data-testid="taken">
        {touches} touches{presses.length > 0 && `, ${presses.length} known positions`}. {rubbed.text}
      </p>
      <Points on={dot !== null} count={presses.length} />
      <Learn needed={needed - touches} thinking={thinking} />
      <p data-testid="flow-text" class={!ready && text ? "wrong" : ""}>
        {text}
      </p>
      <Remarks />
      <Keep kind="rub" />
    </>
  );
}
