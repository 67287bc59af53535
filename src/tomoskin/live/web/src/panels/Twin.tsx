/** The twin drawer: the probe and its presses, and what is broken. */

import { signal } from "@preact/signals";
import { addCommand, truth } from "../commands";
import { addDrawer } from "../drawers";
import { fixed } from "../format";
import { hand, onMessage, scene, send, showTruth } from "../state";

interface TwinState {
  readonly type: "twin";
  readonly breakable: boolean;
  readonly cut: readonly number[];
  /** LSB of one conversion; null: the twin's own. */
  readonly noise: number | null;
}

const twin = signal<TwinState>({ type: "twin", breakable: false, cut: [], noise: null });
onMessage<TwinState>("twin", (message) => (twin.value = message));

/** Radii of probes, m: a fingertip to the heel of a hand. */
const PROBES = [0.004, 0.006, 0.008, 0.01, 0.0125, 0.015, 0.02, 0.025, 0.03];
const NOISES: readonly (readonly [string, number | null])[] = [
  ["its own", null],
  ["2 LSB", 2],
  ["10 LSB", 10],
  ["50 LSB", 50],
];

const choose = (radius: number): void => {
  hand.value = { ...hand.value, probe: { ...hand.value.probe, radius } };
};
PROBES.forEach((radius, k) => {
  const key = String(k + 1);
  const label = `Probe ${fixed(2e3 * radius, 0)} mm`;
  addCommand({ id: `probe-${key}`, label, key, code: key, title: label, run: () => choose(radius) });
});

function Probes() {
  const { probe } = hand.value;
  return (
    <fieldset>
      <legend>Probe, diameter in mm (keys 1–9)</legend>
      <div class="kinds">
        {PROBES.map((radius) => (
          <button
            key={radius}
            type="button"
            aria-pressed={Math.abs(radius - probe.radius) < 1e-6}
            onClick={() => choose(radius)}
          >
            {fixed(2e3 * radius, 0)}
          </button>
        ))}
      </div>
      <label class="range">
        Force of the first contact
        <input
          type="range"
          min={0.5}
          max={probe.maxForce}
          step={0.5}
          value={probe.force}
          onInput={(event) => {
            const force = Number(event.currentTarget.value);
            hand.value = { ...hand.value, probe: { ...hand.value.probe, force } };
          }}
        />
        <output>{fixed(probe.force, 1)} N</output>
      </label>
      <button type="button" aria-pressed={showTruth.value} onClick={truth.run}>
        Show where it is really pressed
      </button>
    </fieldset>
  );
}

function Broken() {
  const { cut, noise } = twin.value;
  const tell = (next: Partial<TwinState>) => send({ type: "twin", cut, noise, ...next });
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
              onClick={() => tell({ cut: turned(e) })}
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
              onClick={() => tell({ noise: value })}
            >
              {label}
            </button>
          ))}
        </div>
      </fieldset>
    </>
  );
}

function View() {
  return (
    <div class="twin">
      <p class="hint">
        Press the sheet with the pointer; with Shift a press stays, so that there may be several.
      </p>
      <Probes />
      {twin.value.breakable && <Broken />}
    </div>
  );
}

addDrawer({
  id: "twin",
  label: "Twin",
  key: "W",
  title: "Probe, presses, and what is broken on the twin",
  offered: () => scene.value?.pressable ?? false,
  View,
});
