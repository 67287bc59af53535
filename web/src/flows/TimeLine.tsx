/** The line of time below the sheet, while something is recorded or played. */

import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { addCommand } from "../commands";
import { link, send, status } from "../state";
import { clock } from "./format";
import { allGaps, allMarks, allSpans, duration, lineOf, position, type Tick } from "./model";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const SEEK_MS = 120;
const marking = signal(false);
/** Where the pointer drags the line to, s; null: nowhere. */
const dragged = signal<number | null>(null);

addCommand({
  id: "mark",
  label: "Mark",
  key: "M",
  code: "m",
  title: "Mark this moment in the recording, with a few words",
  run: () => (marking.value = true),
});

const seek = (at: number): void => send({ type: "seek", at_s: Math.max(0, at) });

function Ticks({ ticks, kind }: { ticks: readonly Tick[]; kind: string }) {
  return (
    <>
      {ticks.map(({ time_s, text }, k) => (
        <i
          key={k}
          class={kind}
          title={`${clock(time_s)} ${text}`}
          style={{ left: `${(100 * time_s) / duration.value}%` }}
        />
      ))}
    </>
  );
}

function Track({ movable }: { movable: boolean }) {
  const track = useRef<HTMLDivElement>(null);
  const last = useRef(0);
  const at = dragged.value ?? position.value;
  const end = duration.value;

  const placeOf = (event: PointerEvent): number => {
    const box = track.current?.getBoundingClientRect();
    if (!box) return 0;
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * end;
  };
  const drag = (event: PointerEvent): void => {
    dragged.value = placeOf(event);
    const time = performance.now();
    if (time - last.current < SEEK_MS) return;
    last.current = time;
    seek(dragged.value);
  };
  const drop = (event: PointerEvent): void => {
    if (dragged.value === null) return;
    seek(placeOf(event));
    dragged.value = null;
  };
  const key = (event: KeyboardEvent): void => {
    const step = event.shiftKey ? 10 : 1;
    const places: Readonly<Record<string, number>> = {
      ArrowLeft: at - step,
      ArrowRight: at + step,
      Home: 0,
      End: end,
    };
    if (!(event.key in places)) return;
    event.preventDefault();
    event.stopPropagation();
    seek(Math.min(end, places[event.key]));
  };
  const handlers = movable
    ? {
        role: "slider" as const,
        tabIndex: 0,
        "aria-label": "Position in the recording, s",
        "aria-valuemin": 0,
        "aria-valuemax": Math.round(end),
        "aria-valuenow": Math.round(at),
        "aria-valuetext": `${clock(at)} of ${clock(end)}`,
        onKeyDown: key,
        onPointerDown: (event: PointerEvent) => {
          (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
          drag(event);
        },
        onPointerMove: (event: PointerEvent) => dragged.value !== null && drag(event),
        onPointerUp: drop,
        onPointerCancel: () => (dragged.value = null),
      }
    : { role: "img" as const, "aria-label": `Recorded for ${clock(at)}` };
  return (
    <div ref={track} class={`track-of-time${movable ? " movable" : ""}`} data-testid="track" {...handlers}>
      <span class="gone" style={{ width: `${(100 * Math.min(at, end)) / end}%` }} />
      {allSpans.value.map((span) => (
        <i
          key={`${span.id} ${span.begin}`}
          class="span"
          data-testid="span"
          title={`Touch ${span.id}, ${clock(span.begin)} to ${clock(span.end)}`}
          style={{
            left: `${(100 * span.begin) / end}%`,
            width: `${(100 * (span.end - span.begin)) / end}%`,
          }}
        />
      ))}
      <Ticks ticks={allGaps.value} kind="gap" />
      <Ticks ticks={allMarks.value} kind="note" />
      <span class="head" style={{ left: `${(100 * Math.min(at, end)) / end}%` }} />
    </div>
  );
}

function MarkForm() {
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => input.current?.focus(), []);
  const done = () => (marking.value = false);
  return (
    <form
      class="marking"
      onSubmit={(event) => {
        event.preventDefault();
        send({ type: "note", text: input.current?.value.trim() || "mark" });
        done();
      }}
      onKeyDown={(event) => {
        event.stopPropagation();
        if (event.key === "Escape") done();
      }}
    >
      <input
        ref={input}
        type="text"
        maxLength={500}
        data-testid="mark-text"
        aria-label="Words for the mark (optional)"
        placeholder="What happens now? (optional)"
      />
      <button type="submit">Mark</button>
      <button type="button" onClick={done}>
        Cancel
      </button>
    </form>
  );
}

function PlayButtons() {
  const replay = status.value?.replay;
  if (!replay) return null;
  return (
    <div role="group" aria-label="Replay">
      <button type="button" data-testid="step" title="Play one step" onClick={() => send({ type: "step" })}>
        Step
      </button>
      <select
        aria-label="Speed"
        data-testid="speed"
        value={String(replay.speed)}
        onChange={({ currentTarget: { value } }) =>
          send({ type: "speed", speed: value === "null" ? null : Number(value) })
        }
      >
        {[...new Set([...SPEEDS, ...(replay.speed === null ? [] : [replay.speed])])]
          .sort((a, b) => a - b)
          .map((speed) => (
            <option key={speed} value={String(speed)}>
              {speed} ×
            </option>
          ))}
        <option value="null">as fast as possible</option>
      </select>
      <button
        type="button"
        data-testid="loop"
        aria-pressed={replay.loop}
        title="Start again at the end"
        onClick={() => send({ type: "loop", on: !replay.loop })}
      >
        Loop
      </button>
    </div>
  );
}

export function TimeLine() {
  const of = lineOf.value;
  // Its room is there from the start: the sheet must not move under a finger.
  if (of === null && !marking.value) return <div class="timeline" aria-hidden="true" />;
  const end = of === "replay" ? ` of ${clock(duration.value)}` : "";
  return (
    <section class="timeline" data-testid="timeline" aria-label="Time line">
      {of === "replay" && <PlayButtons />}
      {of && (
        <output class="when" data-testid="when">
          {of === "recording" && "Recording "}
          {clock(dragged.value ?? position.value)}
          {end}
        </output>
      )}
      {of && <Track movable={of === "replay"} />}
      {marking.value ? (
        <MarkForm />
      ) : (
        <button
          type="button"
          data-testid="do-mark"
          disabled={link.value.phase !== "open"}
          onClick={() => (marking.value = true)}
        >
          Mark <kbd>M</kbd>
        </button>
      )}
    </section>
  );
}
