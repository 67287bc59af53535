/** What calibrations read beside touches, as the server says that it is shown. */

import type { Readings } from "../decode";
import { link, shown } from "../state";
import { BendFigure } from "../twin/BendFigure";
import type { ShownReading } from "../wire";

const NONE: Readings = {};

/** The readings of the frame that is shown which belong in this place. */
function readingsIn(place: ShownReading["place"]): readonly (readonly [string, ShownReading])[] {
  const frame = shown.value;
  const readings = frame?.referenceReady ? frame.readings : NONE;
  return Object.entries(readings).filter(([, reading]) => reading.place === place);
}

function Figure({ name, reading }: { name: string; reading: ShownReading }) {
  const { unit, value, deviation, drawn } = reading;
  if (value === "") return null;
  return (
    <>
      <p class="unit">{unit}</p>
      <p class="large" data-testid={`${name}-value`}>
        {value}
      </p>
      <p class="small">{deviation}</p>
      {drawn && <BendFigure angle={drawn[0]} axis={drawn[1]} />}
    </>
  );
}

/** Beside the sheet: a figure, what else was read, and all of it in words. */
export function ReadingsBesideSheet() {
  return (
    <>
      {readingsIn("sheet").map(([name, reading]) => (
        <section
          key={name}
          class={`reading-panel${link.value.phase === "lost" ? " stale" : ""}`}
          aria-label={reading.sentence}
          data-testid={name}
          title={reading.sentence}
        >
          <Figure name={name} reading={reading} />
          {reading.notes.map((note) => (
            <p class="small" key={note} data-testid={`${name}-note`}>
              {note}
            </p>
          ))}
          <p class={reading.wrong ? "wrong" : "words"} data-testid={`${name}-words`}>
            {reading.words}
          </p>
        </section>
      ))}
    </>
  );
}

/** Above the list of touches: a line each. */
export function ReadingsAboveTouches() {
  return (
    <>
      {readingsIn("touches").map(([name, { words, sentence }]) => (
        <span key={name} class="reading-in-line" title={sentence} data-testid={`${name}-words`}>
          {words}
        </span>
      ))}
    </>
  );
}
