/** The touches as a short list in large figures, and, quietly, as words for a screen reader. */

import { useComputed, useSignal, useSignalEffect } from "@preact/signals";
import type { Touch } from "../decode";
import { fixed, inScale, millimetres, scaleFor, type Scale } from "../format";
import { fingers } from "../screen";
import { limit, link, scene, shown, status } from "../state";
import { elsewhere, halfAxes } from "../sheet/overlay";
import { amountInWords, MEASURANDS } from "../words";
import { next, several, showNext, shownAs } from "./amounts";
import { ReadingsAboveTouches } from "./Readings";

const ROWS = 4;

/** How far the ellipse on the sheet reaches, in mm; nothing where it is unknown. */
function uncertainty(touch: Touch): string {
  const axes = halfAxes(touch);
  return axes ? millimetres(axes[0]) : "";
}

/** What is not certain of a touch, in words; nothing where all is. */
function doubt(touch: Touch): string | undefined {
  if (touch.provisional) return "seen by single drives, not by a whole scan yet";
  if (touch.several > 1) return `${touch.several} touches, too close to separate`;
  return touch.several ? "may be several touches, too close to separate" : undefined;
}

/** Where else it may be, in words. */
const others = (touch: Touch) =>
  elsewhere(touch, scene.value?.same).map(([x, y]) => `or at ${millimetres(x, 0)}, ${millimetres(y, 0)} mm`);

const notes = (touch: Touch) =>
  [touch.own && "by the robot itself", doubt(touch), ...others(touch)].filter(Boolean).join(", ");

function Strength({ touch, scale }: { touch: Touch; scale: Scale }) {
  const name = shownAs.value;
  const amount = name === "change" ? null : touch[name];
  if (name !== "change" && amount) {
    const { perUnit, decimals } = MEASURANDS[name];
    const [value, low, high] = [amount.value, amount.low, amount.high].map((one) => perUnit * one);
    return (
      <td class="large" title={`${amountInWords(amount, name)} (nine in ten)`} data-testid={name}>
        {high === Infinity ? `> ${fixed(low, decimals)}` : fixed(value, decimals)}
        {high < Infinity && (
          <span class="small interval">
            {fixed(low, decimals - 1)}–{fixed(high, decimals - 1)}
          </span>
        )}
      </td>
    );
  }
  return (
    <td class="large">
      <span class="arrow" title={touch.kind}>
        {touch.kind === "decrease" ? "↓" : "↑"}
      </span>
      {inScale(Math.abs(touch.peak), scale)}
    </td>
  );
}

function StrengthTitle({ scale }: { scale: Scale }) {
  const name = shownAs.value;
  const change = `strength, ${scale.unit}`;
  if (!several.value) return <span title="Force and depth are uncalibrated">{change}</span>;
  return (
    <button
      type="button"
      class="quiet"
      title={name === "change" ? next.value : `Estimated from the touch, with the interval that nine in ten lie in for tips as were taught. ${next.value}`}
      onClick={showNext}
    >
      {name === "change" ? change : MEASURANDS[name].felt}
    </button>
  );
}

function Row({ touch, scale }: { touch: Touch; scale: Scale }) {
  return (
    <tr data-testid="touch-row" data-id={touch.id}>
      <th scope="row">
        <span class={touch.own ? "chip itself" : "chip"} title={notes(touch)}>
          {touch.id}
          {touch.several > 0 && "+"}
          {others(touch).length > 0 && "?"}
        </span>
      </th>
      <td class="large">{millimetres(touch.x)}</td>
      <td class="large">{millimetres(touch.y)}</td>
      <td class="small">{uncertainty(touch)}</td>
      <Strength touch={touch} scale={scale} />
    </tr>
  );
}

function Teaching() {
  const reference = status.value?.reference;
  if (!scene.value || !status.value) return <p class="lead">Waiting for the sheet</p>;
  if (reference && !reference.ready) {
    return (
      <>
        <p class="lead">Keep hands off</p>
        <p class="hint">Taking the reference: the sheet as it is now counts as untouched.</p>
        <progress max={reference.needed} value={reference.frames} aria-label="Reference" />
      </>
    );
  }
  if (!scene.value.pressable) return <p class="lead">Press the sheet</p>;
  return (
    <>
      <p class="lead">Press the sheet</p>
      <p class="hint">
        {fingers.value
          ? "Hold for more force, drag to slide. Tap twice and a press stays; twice more, and it lifts."
          : "Hold for more force, or set it with the wheel. Drag to slide. With Shift a press stays."}
      </p>
    </>
  );
}

/** Says which touches there are when that changes, not where they move. */
function Announcer() {
  const ids = useComputed(() => (shown.value?.touches ?? []).map((touch) => touch.id).join(" "));
  const words = useSignal("");
  useSignalEffect(() => {
    void ids.value;
    const timer = window.setTimeout(() => {
      const touches = shown.peek()?.touches ?? [];
      const positions = touches.map(
        (touch) =>
          `touch ${touch.id} at ${millimetres(touch.x, 0)}, ${millimetres(touch.y, 0)} ` +
          ["millimetres", touch.force && amountInWords(touch.force, "force"), touch.depth && amountInWords(touch.depth, "depth"), notes(touch)]
            .filter(Boolean)
            .join(", "),
      );
      words.value = positions.length ? positions.join("; ") : "No touch";
    }, 700);
    return () => window.clearTimeout(timer);
  });
  return (
    <p class="unseen" role="log" aria-live="polite">
      {words}
    </p>
  );
}

export function Touches() {
  const touches = shown.value?.touches ?? [];
  const scale = scaleFor(limit.value, scene.value?.unit ?? "S");
  const stale = link.value.phase === "lost";
  return (
    <section class={`panel touches${stale ? " stale" : ""}`} aria-labelledby="touches-title">
      <h2>
        <span id="touches-title">Touches</span>
        {touches.length > ROWS && <span class="small">{touches.length - ROWS} more on the sheet</span>}
        <ReadingsAboveTouches />
      </h2>
      <div class="list" data-testid="touch-list">
        {touches.length === 0 ? (
          <div class="teaching">
            <Teaching />
          </div>
        ) : (
          <table>
            <thead>
              <tr>
                <th scope="col">
                  <span class="unseen">Number</span>
                </th>
                <th scope="col">x, mm</th>
                <th scope="col">y, mm</th>
                <th scope="col" title="Nine in ten positions lie within the ellipse on the sheet; this is half of its length">
                  ± mm
                </th>
                <th scope="col">
                  <StrengthTitle scale={scale} />
                </th>
              </tr>
            </thead>
            <tbody>
              {touches.slice(0, ROWS).map((touch) => (
                <Row key={touch.id} touch={touch} scale={scale} />
              ))}
            </tbody>
          </table>
        )}
      </div>
      <Announcer />
    </section>
  );
}
