/** Forces from known weights, depths from known travels: what presses, what was recorded, what that tells. */

import { effect, signal } from "@preact/signals";
import type { Measurand } from "../decode";
import { fixed, millimetres } from "../format";
import { hand, scene, send } from "../state";
import { Keep, Leave, Remarks } from "./Keep";
import type { FlowNow, LabelNow } from "../wire";
import { flow, type Phase } from "./model";

type Unit = LabelNow["unit"];
type Words = Partial<Record<Phase, string>> & Readonly<Record<"of" | "first" | "counts", string>>;

const BOTH: Partial<Record<Phase, string>> = {
  rest: "Lift everything off the skin",
  release: "Recorded. Lift it off",
  several: "Several things touch the skin: leave one",
};
const WORDS: Readonly<Record<Measurand, Words>> = {
  force: {
    ...BOTH,
    of: "Weight",
    first: "Say what you will put on",
    press: "Put the weight on, and let it lie",
    hold: "Let it lie still",
    name: "Recorded. Say what that weighs",
    counts: "What lies there",
  },
  depth: {
    ...BOTH,
    of: "Depth",
    first: "Say how deep you will press",
    press: "Press to that depth, and hold",
    hold: "Hold it still",
    name: "Recorded. Say how deep that was",
    counts: "What presses there",
  },
};

const UNITS: Readonly<Record<Measurand, readonly Unit[]>> = { force: ["g", "kg", "N"], depth: ["mm"] };
const value = signal("");
const unit = signal<Unit>("g");

const setLabel = (label: Pick<LabelNow, "value" | "unit">, sure = false): void =>
  send({ type: "flow_label", value: label.value, unit: label.unit, sure });

/** A page that comes later has the label in its field too; another flow has its own units. */
effect(() => {
  const { kind, label } = flow.value;
  if (kind !== "force" && kind !== "depth") return;
  if (!UNITS[kind].includes(unit.peek())) [unit.value, value.value] = [UNITS[kind][0], ""];
  if (!label || value.peek()) return;
  value.value = String(label.value);
  unit.value = label.unit;
});

/** On a simulated skin a press of this page is the weight that lies there, and grows no deeper. */
effect(() => {
  const { kind, label, paused } = flow.value;
  const goes = !paused && scene.value?.pressable;
  const weighed = goes && kind === "force" ? label : null;
  const steady = goes && (weighed !== null || kind === "depth");
  const { probe } = hand.peek();
  if (!steady && probe.grows) return;
  const force = weighed ? Math.min(weighed.si, probe.maxForce) : probe.force;
  hand.value = { ...hand.peek(), probe: { ...probe, force, grows: !steady } };
});

/** Whether the skin is simulated, and says itself how deep it is pressed. */
const saysDepth = (): boolean => flow.value.kind === "depth" && (scene.value?.pressable ?? false);

/** What is wrong with this weight on a simulated skin, in words. */
function tooHeavy(label: LabelNow): string | null {
  const most = scene.value?.probe.max_force_n ?? Infinity;
  if (flow.value.kind !== "force" || !scene.value?.pressable || label.si <= most) return null;
  return `The simulated skin is pressed with at most ${fixed(most, 0)} N: choose a smaller weight.`;
}

function Asked() {
  const { asked, meant } = flow.value;
  if (!asked || !meant) return null;
  return (
    <div class="wrong" role="alert" data-testid="flow-asked">
      <p>
        {asked.text} is unusual for a touch. Did you mean {meant.text}?
      </p>
      <div class="does">
        <button type="button" data-testid="flow-meant" onClick={() => setLabel(meant, true)}>
          {meant.value} {meant.unit}
        </button>
        <button type="button" onClick={() => setLabel(asked, true)}>
          {asked.value} {asked.unit} is right
        </button>
      </div>
    </div>
  );
}

function LabelForm({ kind }: { kind: Measurand }) {
  return (
    <form
      class="row"
      onSubmit={(event) => {
        event.preventDefault();
        setLabel({ value: Number(value.value), unit: unit.value });
      }}
    >
      <label class="row-label" for="label">
        {WORDS[kind].of}
      </label>
      <input
        id="label"
        type="number"
        inputMode="decimal"
        min="0"
        step="any"
        required
        data-testid="label"
        value={value.value}
        onInput={({ currentTarget }) => (value.value = currentTarget.value)}
      />
      <select
        aria-label={`Unit of the ${kind === "force" ? "weight" : "depth"}`}
        data-testid="label-unit"
        value={unit.value}
        onChange={({ currentTarget }) => (unit.value = currentTarget.value as Unit)}
      >
        {UNITS[kind].map((each) => (
          <option key={each}>{each}</option>
        ))}
      </select>
      <button type="submit" data-testid="label-set">
        Set
      </button>
    </form>
  );
}

/** "read 12 % high", of an amount whose own press was left out. */
function missed(error: number | undefined): string {
  if (error === undefined) return "";
  const high = error >= 0 ? "high" : "low";
  return `, read ${fixed(100 * Math.abs(error), 0)} % ${high}`;
}

function Recorded() {
  const { presses, labels, figures } = flow.value;
  return (
    <ol class="placements" aria-label="Presses recorded">
      {presses.map(([x, y], k) => (
        <li key={k} class={figures.doubtful?.includes(k) ? "doubtful" : ""} data-testid="labelled">
          <span>
            {k + 1}. {labels[k]}
            <span class="small">
              {" "}
              at {millimetres(x, 0)}, {millimetres(y, 0)} mm{missed(figures.errors?.[k])}
            </span>
          </span>
          <button
            type="button"
            class="quiet"
            aria-label={`Delete press ${k + 1}`}
            onClick={() => send({ type: "flow_delete", number: k })}
          >
            Delete
          </button>
        </li>
      ))}
    </ol>
  );
}

/** What is to be done now. */
function lead({ phase, label, paused }: FlowNow, words: Words): string | undefined {
  if (paused) return "Paused while a recording is played";
  if (phase === "press" && saysDepth()) return "Press anywhere, and hold";
  return !label && phase === "press" ? words.first : words[phase];
}

export function Amount({ kind }: { kind: Measurand }) {
  const { presses, label, text, thinking } = flow.value;
  const heavy = label && tooHeavy(label);
  return (
    <>
      <p class="lead" role="status" data-testid="phase">
        {lead(flow.value, WORDS[kind])}
      </p>
      {saysDepth() ? (
        <p class="hint">The simulated skin says how deep it is. Change the force from press to press.</p>
      ) : (
        <LabelForm kind={kind} />
      )}
      <Asked />
      {label && (
        <p class="hint" data-testid="label-now">
          {WORDS[kind].counts} counts as {label.text}.
        </p>
      )}
      {heavy && <p class="wrong">{heavy}</p>}
      <div class="does">
        <Leave />
      </div>
      <Keep kind={kind} />
      <p data-testid="taken">
        {presses.length} press{presses.length === 1 ? "" : "es"} recorded{thinking ? ", computing…" : ""}
      </p>
      <p data-testid="flow-text">{text}</p>
      <Remarks />
      <Recorded />
    </>
  );
}
