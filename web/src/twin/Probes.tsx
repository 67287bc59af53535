/** The probe of the next press: its face, size, turn and force. */

import { addCommand, truth } from "../commands";
import { FACES, rim } from "../faces";
import { fixed } from "../format";
import type { Probe } from "../presses";
import { hand, showTruth } from "../state";
import { Slider } from "./Slider";

/** Radii of probes, m: a fingertip to the heel of a hand. */
const PROBES = [0.004, 0.006, 0.008, 0.01, 0.0125, 0.015, 0.02, 0.025, 0.03];
const DEGREE = Math.PI / 180;

const choose = (part: Partial<Probe>): void => {
  hand.value = { ...hand.value, probe: { ...hand.value.probe, ...part } };
};
PROBES.forEach((radius, k) => {
  const key = String(k + 1);
  const label = `Probe ${fixed(2e3 * radius, 0)} mm`;
  addCommand({ id: `probe-${key}`, label, key, code: key, title: label, run: () => choose({ radius }) });
});

/** A face from above, as wide as it can be. */
function Picture({ face }: { readonly face: Probe["face"] }) {
  const points = rim(face, 8, 0).map(([x, y]) => `${x.toFixed(1)},${(-y).toFixed(1)}`);
  return (
    <svg class="face" viewBox="-10 -10 20 20" aria-hidden="true">
      <polygon points={points.join(" ")} />
    </svg>
  );
}

export function Probes() {
  const { probe } = hand.value;
  const turned = Math.round(probe.angle / DEGREE);
  return (
    <fieldset>
      <legend>Probe</legend>
      <div class="kinds" role="group" aria-label="Face of the probe">
        {FACES.map((face) => (
          <button
            key={face.id}
            type="button"
            data-testid={`face-${face.id}`}
            aria-pressed={probe.face.id === face.id}
            onClick={() => choose({ face })}
          >
            <Picture face={face} /> {face.label}
          </button>
        ))}
      </div>
      <div class="kinds" role="group" aria-label="Size of the probe, mm">
        {PROBES.map((radius, k) => (
          <button
            key={radius}
            type="button"
            title={`${fixed(2e3 * radius, 0)} mm wide (key ${k + 1})`}
            aria-pressed={Math.abs(radius - probe.radius) < 1e-6}
            onClick={() => choose({ radius })}
          >
            {fixed(2e3 * radius, 0)}
          </button>
        ))}
        <span class="unit">mm</span>
      </div>
      {probe.face.shape !== "circle" && (
        <Slider
          name="Rotation"
          id="probe-angle"
          low={0}
          high={175}
          step={5}
          value={turned}
          words={`${turned}°`}
          set={(degrees) => choose({ angle: degrees * DEGREE })}
        />
      )}
      <Slider
        name="First force"
        id="probe-force"
        low={0.5}
        high={probe.maxForce}
        step={0.5}
        value={probe.force}
        words={`${fixed(probe.force, 1)} N`}
        set={(force) => choose({ force })}
      />
      <button type="button" aria-pressed={showTruth.value} onClick={truth.run}>
        Show the true presses
      </button>
    </fieldset>
  );
}
