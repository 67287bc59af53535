/** Bending and stretching the twin's sheet. */

import { fixed } from "../format";
import { BendFigure } from "./BendFigure";
import type { TwinBend, TwinStretch } from "../wire";
import { layFlat, refusal, twin, want, wanted } from "./model";
import { Slider } from "./Slider";

const DEGREE = Math.PI / 180;
const degrees = (angle: number): number => Math.round(angle / DEGREE);

const bendBy = (part: Partial<TwinBend>): void => want({ bend: { ...wanted.value.bend, ...part } });
const stretchBy = (part: Partial<TwinStretch>): void =>
  want({ stretch: { ...wanted.value.stretch, ...part } });

/** A direction on the sheet, from x counter-clockwise. */
function Axis({ id, value, set }: { id: string; value: number; set: (axis: number) => void }) {
  const shown = degrees(value);
  return (
    <Slider
      name="Axis, from x"
      id={id}
      low={0}
      high={175}
      step={5}
      value={shown}
      words={`${shown}°`}
      set={(next) => set(next * DEGREE)}
    />
  );
}

function Bend() {
  const { bends, size_m: size } = twin.value;
  const { bend } = wanted.value;
  const angle = degrees(bend.angle);
  const width = Math.round(1e3 * bend.length);
  return (
    <>
      <Slider
        name={bends === "joint" ? "Joint" : "Bend"}
        id="bend-angle"
        low={-90}
        high={150}
        step={1}
        value={angle}
        words={`${fixed(angle, 0)}°`}
        set={(next) => bendBy({ angle: next * DEGREE })}
      />
      {bends === "hinge" && (
        <>
          <Axis id="bend-axis" value={bend.axis} set={(axis) => bendBy({ axis })} />
          <Slider
            name="Bend width"
            id="bend-width"
            low={20}
            high={Math.max(20, Math.round(1e3 * size))}
            step={5}
            value={width}
            words={`${width} mm`}
            set={(next) => bendBy({ length: 1e-3 * next })}
          />
        </>
      )}
      <BendFigure angle={bend.angle} axis={bends === "hinge" ? bend.axis : null} />
    </>
  );
}

function Stretch() {
  const { stretch } = wanted.value;
  const percent = (part: number) => Math.round(100 * part);
  const slider = (name: string, key: "along" | "across") => (
    <Slider
      name={name}
      id={`stretch-${key}`}
      low={-20}
      high={30}
      step={1}
      value={percent(stretch[key])}
      words={`${fixed(percent(stretch[key]), 0)} %`}
      set={(next) => stretchBy({ [key]: next / 100 })}
    />
  );
  return (
    <>
      {slider("Stretch along", "along")}
      {slider("Stretch across", "across")}
      <Axis id="stretch-axis" value={stretch.axis} set={(axis) => stretchBy({ axis })} />
    </>
  );
}

export function Bends() {
  const { bend, stretch } = wanted.value;
  const level = bend.angle === 0 && stretch.along === 0 && stretch.across === 0;
  return (
    <fieldset>
      <legend>Bend and stretch</legend>
      {twin.value.bends && <Bend />}
      <Stretch />
      {refusal.value && (
        <p class="wrong" role="alert" data-testid="bend-refused">
          {refusal.value}
        </p>
      )}
      <button type="button" data-testid="lay-flat" disabled={level} onClick={layFlat}>
        Reset bend and stretch
      </button>
    </fieldset>
  );
}
