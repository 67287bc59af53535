/** Where the age of an image comes from: a table of stages, and the frames that took longest. */

import { fixed } from "../format";
import { status } from "../state";

const MEANINGS: Readonly<Record<string, string>> = {
  sample: "between the scans of two frames, by the device",
  decode: "from a frame's last byte to the pipeline",
  reconstruct: "voltages, image, touches",
  publish: "from the touches to the last byte given to a page",
  paint: "from its arrival to the end of drawing; the slowest page",
};

const milli = (value: number | null): string => (value === null ? "–" : fixed(value, 2));

export function Budget() {
  return (
    <>
      <Stages />
      <Slowest />
    </>
  );
}

function Slowest() {
  const slowest = status.value?.slowest ?? [];
  return slowest.length === 0 ? null : (
    <details class="budget" data-testid="slowest">
      <summary>The slowest frames, and why</summary>
      <ol>
        {slowest.map(({ sequence, host_time_s, text }) => (
          <li key={host_time_s}>
            frame {sequence}: {text}
          </li>
        ))}
      </ol>
    </details>
  );
}

function Stages() {
  return (
    <table class="budget" data-testid="budget">
      <caption class="unseen">Time of each stage, ms</caption>
      <thead>
        <tr>
          <th scope="col">stage</th>
          <th scope="col">median, ms</th>
          <th scope="col">p99, ms</th>
        </tr>
      </thead>
      <tbody>
        {status.value?.stages.map(({ name, p50_ms, p99_ms }) => (
          <tr key={name} data-testid={`stage-${name}`}>
            <th scope="row">
              <strong>{name}</strong> <small>{MEANINGS[name]}</small>
            </th>
            <td>{milli(p50_ms)}</td>
            <td>{milli(p99_ms)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
