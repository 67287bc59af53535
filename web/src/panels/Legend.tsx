/** The colour scale of the sheet, its numbers and unit, and "Fit colours". */

import { useEffect, useRef } from "preact/hooks";
import { MAP_SIZE } from "../colours";
import { fitColours } from "../commands";
import { inScale, scaleFor } from "../format";
import { narrow } from "../screen";
import { AMOUNTS, percent, unresolved } from "../signals/unresolved";
import { limit, ownLimit, scene } from "../state";
import { theme } from "../theme";

/** The map as a strip: upright with the largest increase on top; lying, with it at the right. */
function Strip({ map }: { map: Uint8Array }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const lying = narrow.value;
  useEffect(() => {
    const pen = canvas.current?.getContext("2d");
    if (!pen) return;
    const strip = lying ? pen.createImageData(MAP_SIZE, 1) : pen.createImageData(1, MAP_SIZE);
    for (let k = 0; k < MAP_SIZE; k++) {
      const from = 4 * (lying ? k : MAP_SIZE - 1 - k);
      strip.data.set(map.subarray(from, from + 4), 4 * k);
    }
    pen.putImageData(strip, 0, 0);
  }, [map, lying]);
  return <canvas ref={canvas} width={lying ? MAP_SIZE : 1} height={lying ? 1 : MAP_SIZE} class="strip" />;
}

const PARTS = [1, 0.5, 0, -0.5, -1];

/** Of the map of what the data cannot tell. */
function LeftOpen() {
  const marks = narrow.value ? [0, 0.25, 0.5, 0.75, 1] : [1, 0.75, 0.5, 0.25, 0];
  return (
    <aside class="legend" aria-label="Colour scale: part of a change that the data leave open, %">
      <p class="unit">left open, %</p>
      <div class="scale">
        <Strip map={AMOUNTS} />
        <ol>
          {marks.map((mark) => (
            <li key={mark}>{percent(mark)}</li>
          ))}
        </ol>
      </div>
    </aside>
  );
}

export function Legend() {
  if (!scene.value) return null;
  if (unresolved.value) return <LeftOpen />;
  const scale = scaleFor(limit.value, scene.value.unit);
  const fixedScale = scaleFor(scene.value.limit, scene.value.unit);
  const fixedLimit = inScale(scene.value.limit, fixedScale);
  const resetTitle = `Back to the skin's own limits, ±${fixedLimit} ${fixedScale.unit}`;
  const marks = (narrow.value ? [...PARTS].reverse() : PARTS).map((part) => {
    const value = part * limit.value;
    return (value > 0 ? "+" : "") + (part === 0 ? "0" : inScale(value, scale));
  });
  return (
    <aside class="legend" aria-label={`Colour scale: change of conductivity, ${scale.unit}`}>
      <p class="unit">change, {scale.unit}</p>
      <div class="scale">
        <Strip map={theme.value.map} />
        <ol>
          {marks.map((mark) => (
            <li key={mark}>{mark}</li>
          ))}
        </ol>
      </div>
      <button type="button" title={fitColours.title} onClick={fitColours.run}>
        Fit colours <kbd>{fitColours.key}</kbd>
      </button>
      {ownLimit.value !== null && (
        <button type="button" title={resetTitle} onClick={() => (ownLimit.value = null)}>
          Reset
        </button>
      )}
      <p class="ring" title="The ellipse around a touch holds its position with 90 % probability">
        <svg viewBox="0 0 14 14" aria-hidden="true">
          <circle cx="7" cy="7" r="5.5" />
        </svg>{" "}
        90 %
      </p>
    </aside>
  );
}
