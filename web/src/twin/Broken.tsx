/** Wires that break, and the converter's noise. */

import { scene } from "../state";
import { harm, twin } from "./model";

const NOISES: readonly (readonly [string, number | null])[] = [
  ["as in the twin", null],
  ["2 LSB", 2],
  ["10 LSB", 10],
  ["50 LSB", 50],
];

export function Broken() {
  const { cut, noise } = twin.value;
  const turned = (e: number) => (cut.includes(e) ? cut.filter((other) => other !== e) : [...cut, e]);
  return (
    <>
      <fieldset>
        <legend>Cut an electrode's wire</legend>
        <div class="kinds">
          {scene.value?.electrodes.map(({ label }, e) => (
            <button
              key={label}
              type="button"
              data-testid={`cut-${e + 1}`}
              aria-pressed={cut.includes(e)}
              onClick={() => harm({ cut: turned(e) })}
            >
              {label}
            </button>
          ))}
        </div>
      </fieldset>
      <fieldset>
        <legend>Noise of the converter</legend>
        <div class="kinds">
          {NOISES.map(([label, value]) => (
            <button
              key={label}
              type="button"
              data-testid={`noise-${value ?? "own"}`}
              aria-pressed={noise === value}
              onClick={() => harm({ noise: value })}
            >
              {label}
            </button>
          ))}
        </div>
      </fieldset>
    </>
  );
}
