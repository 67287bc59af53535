/** The presses of this page, one by one: where, how hard, and lifted. */

import { fixed, millimetres } from "../format";
import { lifted, MAX_PRESSES, reforced } from "../presses";
import { hand } from "../state";

export function Presses() {
  const { held } = hand.value;
  return (
    <fieldset>
      <legend>Presses</legend>
      {held.length === 0 ? (
        <p class="help">
          Press the sheet with the pointer. With Shift a press stays. At most {MAX_PRESSES} presses.
        </p>
      ) : (
        <ol class="held">
          {held.map((press, k) => (
            <li key={k} data-testid="held">
              <span>
                {press.face.label}, {millimetres(press.x, 0)}, {millimetres(press.y, 0)} mm
              </span>
              <button
                type="button"
                aria-label={`Less force on press ${k + 1}`}
                onClick={() => (hand.value = reforced(hand.value, press, -1))}
              >
                −
              </button>
              <output>{fixed(press.force, 1)} N</output>
              <button
                type="button"
                aria-label={`More force on press ${k + 1}`}
                onClick={() => (hand.value = reforced(hand.value, press, 1))}
              >
                +
              </button>
              <button
                type="button"
                aria-label={`Lift press ${k + 1}`}
                onClick={() => (hand.value = lifted(hand.value, press))}
              >
                Lift
              </button>
            </li>
          ))}
        </ol>
      )}
    </fieldset>
  );
}
