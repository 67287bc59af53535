/** The sheet: image, marks and furniture, in one view; the place where one presses. */

import { effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { fixed, inScale, millimetres, scaleFor } from "../format";
import {
  hand,
  limit,
  link,
  newest,
  onRepaint,
  scene,
  shown,
  showTruth,
  smoothed,
  status,
  topology,
} from "../state";
import { painted, percent, unresolved } from "../signals/unresolved";
import { theme } from "../theme";
import { twin } from "../twin/model";
import { Target } from "../flows/Target";
import { narrow } from "../screen";
import { Furniture, LABELS } from "./Furniture";
import { Painter } from "./painter";
import { cursor, listen } from "./pointer";
import { depthAt, heights, Relief } from "./relief";
import { hovered, locator, seen, shownDrive, shownPair } from "./space";
import { around, boxOf, fit, type Margin, type View } from "./view";

/** Room for the electrodes' labels all round and for the legend at the left; on a telephone for
 * the labels alone, px. */
function margin(): Margin {
  if (!narrow.value) return { left: 186, right: 64, top: 52, bottom: 80 };
  const longest = Math.max(2, ...(scene.value?.electrodes.map(({ label }) => label.length) ?? []));
  const side = LABELS.narrow.beside + 10 * longest;
  return { left: side, right: side, top: 32, bottom: 32 };
}
const NOWHERE: View = { scale: 1, originX: 0, originY: 0, width: 0, height: 0 };

export const view = signal<View>(NOWHERE);
const size = signal<readonly [number, number]>([0, 0]);
const accelerated = signal(true);
const element: { sheet: HTMLElement | null } = { sheet: null };

/** Where the sheet is on the page, for tests that press at a place in metres. */
export const sheetElement = (): HTMLElement | null => element.sheet;

/** The value under the pointer, in words, always at the same place. */
function Reading() {
  const place = hovered.value;
  const frame = shown.value;
  const found = place && locator.value?.find(...place);
  if (!scene.value || !frame || !place || !found) return null;
  const scale = scaleFor(limit.value, scene.value.unit);
  const open = unresolved.value;
  return (
    <p class="reading" data-testid="reading">
      {millimetres(place[0], 0)}, {millimetres(place[1], 0)} mm{" "}
      {!open && <span class="of">change </span>}
      <strong>{open ? percent(open[found.cell]) : inScale(frame.image[found.cell], scale)}</strong>{" "}
      {open ? "% left open" : scale.unit}
      {depthAt(frame, found)}
    </p>
  );
}

/** Where the keyboard's probe is and what it holds, for who cannot see it. */
function Probe() {
  const place = cursor.value;
  if (!place) return null;
  const held = hand.value.held.map(({ x, y, force }) => `${millimetres(x, 0)}, ${millimetres(y, 0)} with ${fixed(force, 1)} newtons`);
  return (
    <p class="unseen" role="status" data-testid="probe">
      Probe at {millimetres(place[0], 0)}, {millimetres(place[1], 0)} millimetres.{" "}
      {held.length > 0 && `Pressed at ${held.join("; ")}.`}
    </p>
  );
}

export function Sheet() {
  const sheet = useRef<HTMLDivElement>(null);
  const image = useRef<HTMLCanvasElement>(null);
  const marks = useRef<HTMLCanvasElement>(null);

  useEffect(() => {
    if (!sheet.current || !image.current || !marks.current) return;
    element.sheet = sheet.current;
    const painter = new Painter(image.current, marks.current, () => view.peek());
    accelerated.value = painter.accelerated;
    onRepaint(painter.request);
    const undo = [
      listen(sheet.current, () => view.peek()),
      effect(() => {
        const [width, height] = size.value;
        if (scene.value && width > 0) {
          view.value = seen.value
            ? around(seen.value, width, height, margin())
            : fit(boxOf(scene.value.outline), width, height, margin());
        }
        painter.resize(width, height);
      }),
      effect(() => {
        void [view.value, theme.value, topology.value, limit.value, smoothed.value, painted.value, showTruth.value, hand.value, cursor.value, heights.value, twin.value];
        painter.request();
      }),
      () => painter.stop(),
    ];
    const observer = new ResizeObserver(([entry]) => {
      size.value = [entry.contentRect.width, entry.contentRect.height];
    });
    observer.observe(sheet.current);
    return () => {
      observer.disconnect();
      for (const step of undo) step();
    };
  }, []);

  const stale =
    (link.value.phase === "lost" && newest.count > 0) || shown.value?.pictured === false;
  const pressable = scene.value?.pressable ?? false;
  return (
    <div
      ref={sheet}
      class={`sheet${stale ? " stale" : ""}${pressable ? " pressable" : ""}${cursor.value ? " keyed" : ""}`}
      data-testid="sheet"
      tabIndex={0}
      role="application"
      aria-label={
        pressable
          ? "The sheet. Arrow keys move the probe, Enter presses or lifts, plus and minus set the force."
          : "The sheet"
      }
    >
      <canvas ref={image} />
      <canvas ref={marks} />
      {scene.value && view.value.width > 0 && (
        <Furniture
          scene={scene.value}
          view={view.value}
          sick={status.value?.sick ?? []}
          drive={shownDrive.value}
          pair={shownPair.value}
        />
      )}
      {view.value.width > 0 && <Target view={view.value} />}
      <Reading />
      {view.value.seen && <Relief view={view.value} />}
      <Probe />
      {!accelerated.value && (
        <p class="remark">This browser lacks WebGL 2: the sheet is drawn flat, and more slowly.</p>
      )}
    </div>
  );
}
