/** Each skin in a row: how it is doing, what touches it, and the way to its own page. */

import { states, robot, touches } from "./model";

function strength(force: number | null): string {
  return force === null ? "" : ` ${force.toFixed(1)} N`;
}

function Row({ name, frame }: { name: string; frame: string }) {
  const state = states.value?.skins[name];
  const found = touches.value[name]?.touches ?? [];
  const trouble = state?.problem ?? (state && !state.ready ? "the untouched skin is being measured" : null);
  const rate = state ? `${state.fps.toFixed(0)} frames/s, ${state.lost} lost` : "";
  return (
    <li data-testid={`skin-${name}`} class={trouble ? "amber" : ""}>
      <a href={`./skin/${name}/`}>{name}</a>
      <span class="frame">{frame}</span>
      <span class="rate">{rate}</span>
      <span class="found" data-testid={`touches-${name}`}>
        {found.length === 0 ? "no touch" : `touch ${found.map((t) => `${t.id}${strength(t.force)}`).join(", ")}`}
      </span>
      {trouble && <p role="status">{trouble}</p>}
    </li>
  );
}

export function Skins() {
  return (
    <div class="skins">
      <ul aria-label="Skins">
        {robot.value?.skins.map(({ name, frame }) => <Row key={name} name={name} frame={frame} />)}
      </ul>
      {robot.value?.undrawn.map((why) => <p key={why}>Not drawn: {why}</p>)}
    </div>
  );
}
