/** Each skin in a row: how it is doing, what touches it, and the way to its own page. */

import { fixed, millimetres } from "../format";
import { states, robot, touches, type SkinTouches } from "./model";

/** What touches a skin, a line each: its number as in the picture, x, y, z, and newtons. */
export function touchLines(found: SkinTouches[string] | undefined): string[] {
  if (!found?.valid) return ["not known"];
  if (found.touches.length === 0) return ["no touch"];
  return found.touches.map(({ id, position, force, more_than: least, is_self }) => {
    const place = position.map((value) => millimetres(value, 0)).join(", ");
    const newtons = least === null ? fixed(force, 1) : `> ${fixed(least, 1)}`;
    const at = found.pose_problem === null ? ` at ${place} mm` : "";
    return `touch ${id}${is_self ? " by the robot" : ""}${at}${force === null ? "" : `, ${newtons} N`}`;
  });
}

function Row({ name, frame }: { name: string; frame: string }) {
  const state = states.value?.skins[name];
  const trouble = state?.problem ?? (state && !state.ready ? "the untouched skin is being measured" : null);
  const lost = touches.value[name]?.pose_problem;
  const rate = state ? `${state.fps.toFixed(0)} frames/s, ${state.lost} lost` : "";
  return (
    <li data-testid={`skin-${name}`} class={trouble ? "amber" : ""}>
      <a href={`./skin/${name}/`}>{name}</a>
      <span class="frame">{frame}</span>
      <span class="rate">{rate}</span>
      <span class="found" data-testid={`touches-${name}`}>
        {touchLines(touches.value[name]).map((line) => <span key={line}>{line}</span>)}
      </span>
      {trouble && <p role="status">{trouble}</p>}
      {lost && <p>{lost}</p>}
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
