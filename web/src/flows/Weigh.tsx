/** Forces from known weights: what lies there, what was recorded, what that tells. */

import { effect, signal } from "@preact/signals";
import { fixed, millimetres } from "../format";
import { hand, scene, send } from "../state";
import { Keep, Leave, Remarks } from "./Keep";
import type { FlowNow, WeightNow } from "../wire";
import { flow, type Phase } from "./model";

type Unit = WeightNow["unit"];

const PHASES: Partial<Record<Phase, string>> = {
  rest: "Lift everything off the skin",
  press: "Put the weight on, and let it lie",
  hold: "Let it lie still",
  release: "Recorded. Lift it off",
  several: "Several things touch the skin: leave one",
  name: "Recorded. Say what that weighs",
};

const UNITS: readonly Unit[] = ["g", "kg", "N"];
const value = signal("");
const unit = signal<Unit>("g");

const setWeight = (weight: Pick<WeightNow, "value" | "unit">, sure = false): void =>
  send({ type: "flow_weight", value: weight.value, unit: weight.unit, sure });

/** A page that comes later has the weight in its field too. */
effect(() => {
  const { weight } = flow.value;
  if (!weight || value.peek()) return;
  value.value = String(weight.value);
  unit.value = weight.unit;
});

/** On a simulated skin a press of this page is the weight that lies there. */
effect(() => {
  const { kind, weight, paused } = flow.value;
  const weighed = kind === "force" && !paused && scene.value?.pressable && weight ? weight : null;
  const { probe } = hand.peek();
  if (!weighed && probe.grows) return;
  const force = weighed ? Math.min(weighed.newtons, probe.maxForce) : probe.force;
  hand.value = { ...hand.peek(), probe: { ...probe, force, grows: !weighed } };
});

/** What is wrong with this weight on a simulated skin, in words. */
function tooHeavy(weight: WeightNow): string | null {
  const most = scene.value?.probe.max_force_n ?? Infinity;
  if (!scene.value?.pressable || weight.newtons <= most) return null;
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
        <button type="button" data-testid="flow-meant" onClick={() => setWeight(meant, true)}>
          {meant.value} {meant.unit}
        </button>
        <button type="button" onClick={() => setWeight(asked, true)}>
          {asked.value} {asked.unit} is right
        </button>
      </div>
    </div>
  );
}

function WeightForm() {
  return (
    <form
      class="row"
      onSubmit={(event) => {
        event.preventDefault();
        setWeight({ value: Number(value.value), unit: unit.value });
      }}
    >
      <label class="row-label" for="weight">
        Weight
      </label>
      <input
        id="weight"
        type="number"
        inputMode="decimal"
        min="0"
        step="any"
        required
        data-testid="weight"
        value={value.value}
        onInput={({ currentTarget }) => (value.value = currentTarget.value)}
      />
      <select
        aria-label="Unit of the weight"
        data-testid="weight-unit"
        value={unit.value}
        onChange={({ currentTarget }) => (unit.value = currentTarget.value as Unit)}
      >
        {UNITS.map((each) => (
          <option key={each}>{each}</option>
        ))}
      </select>
      <button type="submit" data-testid="weight-set">
        Set
      </button>
    </form>
  );
}

/** "read 12 % high", of a force whose own press was left out. */
function missed(error: number | undefined): string {
  if (error === undefined) return "";
  const high = error >= 0 ? "high" : "low";
  return `, read ${fixed(100 * Math.abs(error), 0)} % ${high}`;
}

function Recorded() {
  const { presses, weights, figures } = flow.value;
  return (
    <ol class="placements" aria-label="Placements recorded">
      {presses.map(([x, y], k) => (
        <li key={k} class={figures.doubtful?.includes(k) ? "doubtful" : ""} data-testid="placement">
          <span>
            {k + 1}. {weights[k]}
            <span class="small">
              {" "}
              at {millimetres(x, 0)}, {millimetres(y, 0)} mm{missed(figures.errors?.[k])}
            </span>
          </span>
          <button
            type="button"
            class="quiet"
            aria-label={`Delete placement ${k + 1}`}
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
function lead({ phase, weight, paused }: FlowNow): string | undefined {
  if (paused) return "Paused while a recording is played";
  return !weight && phase === "press" ? "Say what you will put on" : PHASES[phase];
}

export function Weigh() {
  const { presses, weight, text, thinking } = flow.value;
  const heavy = weight && tooHeavy(weight);
  return (
    <>
      <p class="lead" role="status" data-testid="phase">
        {lead(flow.value)}
      </p>
      <WeightForm />
      <Asked />
      {weight && (
        <p class="hint" data-testid="weight-now">
          What lies there counts as {weight.text}.
        </p>
      )}
      {heavy && <p class="wrong">{heavy}</p>}
      <div class="does">
        <Leave />
      </div>
      <Keep kind="force" />
      <p data-testid="taken">
        {presses.length} placement{presses.length === 1 ? "" : "s"} recorded{thinking ? ", computing…" : ""}
      </p>
      <p data-testid="flow-text">{text}</p>
      <Remarks />
      <Recorded />
    </>
  );
}
