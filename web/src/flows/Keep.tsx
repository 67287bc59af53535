/** What ends every flow: leaving it, or a name for what was learnt. */

import { type Signal, signal } from "@preact/signals";
import { send } from "../state";
import { nameProblem } from "./format";
import { flow } from "./model";

const names: Record<string, Signal<string>> = {
  mapping: signal("mapped"),
  touch: signal("touch"),
  rub: signal("rubbed"),
  force: signal("force"),
  depth: signal("depth"),
};

/** How much was recorded when leaving was asked for; null: it was not. */
const asked = signal<number | null>(null);

/** Leave the flow; asked for twice where something was recorded, since that is forgotten. */
export function Leave() {
  const { presses, rubbed } = flow.value;
  const count = presses.length + (rubbed?.touches ?? 0);
  const sure = count > 0 && asked.value === count;
  const leave = () => {
    asked.value = sure ? null : count;
    if (sure || count === 0) send({ type: "flow_end" });
  };
  return (
    <button type="button" data-testid="flow-end" onClick={leave}>
      {sure ? "Forget all of it" : "Leave"}
    </button>
  );
}

export function Keep({ kind }: { kind: string }) {
  const name = (names[kind] ??= signal(kind));
  const problem = nameProblem(name.value);
  return (
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
        value={name.value}
        onInput={({ currentTarget }) => (name.value = currentTarget.value)}
      />
      <button type="submit" class="main" data-testid="flow-keep" disabled={!flow.value.ready || problem !== null}>
        Save and use
      </button>
      {problem && (
        <p class="wrong" role="alert">
          {problem}
        </p>
      )}
    </form>
  );
}

/** What is wrong with what was pressed, in words. */
export function Remarks() {
  const remarks = flow.value.figures.remarks ?? [];
  return (
    <>
      {remarks.map((remark) => (
        <p key={remark} class="wrong" data-testid="flow-remark">
          {remark}
        </p>
      ))}
    </>
  );
}
