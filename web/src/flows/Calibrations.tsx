/** Which calibrations are in use, and how far today's frames are from what they were learnt on. */

import { send, status } from "../state";
import { calibrations, files } from "./model";

type Of = "touch" | "force" | "depth";

const WITHOUT: Readonly<Record<Of, string>> = {
  touch: "Positions of touches come from the voltages and the model of the skin.",
  force: "No weights have been learnt: strengths are changes of conductivity.",
  depth: "No depths have been learnt: they are uncalibrated.",
};
const WITH: Readonly<Record<Of, string>> = {
  touch: "Positions of touches come from",
  force: "Forces of touches come from",
  depth: "Depths of touches come from",
};

function Health() {
  const health = status.value?.calibration;
  if (!health) return null;
  return (
    <div data-testid="calibration-health" class={health.well ? "" : "wrong"}>
      {health.findings.map((finding) => (
        <p key={finding}>{finding}</p>
      ))}
    </div>
  );
}

export function InUse({ of }: { of: Of }) {
  const known = calibrations.value[of];
  const kept = (files.value?.files ?? []).filter(({ name }) => name.endsWith(".npz"));
  return (
    <>
      <p data-testid={of === "depth" ? "calibration-of-depth" : "calibration"}>
        {known === null
          ? WITHOUT[of]
          : `${WITH[of]} ${known || "the calibration that tomoskin was started with"}.`}
      </p>
      {of === "touch" && known !== null && <Health />}
      {(kept.length > 0 || known !== null) && (
        <label class="row">
          <span>{of === "depth" ? "Depths from" : "Calibration"}</span>
          <select
            value={known ?? ""}
            onChange={({ currentTarget: { value } }) =>
              send({ type: "calibration", name: value || null, of })
            }
          >
            <option value="">none</option>
            {kept.map(({ name }) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
      )}
    </>
  );
}
