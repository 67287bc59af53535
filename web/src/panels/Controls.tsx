/** Every command as a button with its words and its key. */

import { signal } from "@preact/signals";
import * as commands from "../commands";
import type { Command } from "../commands";
import { fixed } from "../format";
import { heights, relief } from "../sheet/relief";
import { inSpace, space } from "../sheet/space";
import { hand, keepPresses, link, scene, showTruth, smoothed, status } from "../state";

interface ButtonProps {
  readonly command: Command;
  readonly pressed?: boolean;
  readonly label?: string;
  /** The server must be there to do it. */
  readonly remote?: boolean;
}

function Button({ command, pressed, label, remote = false }: ButtonProps) {
  return (
    <button
      type="button"
      title={command.title}
      data-testid={`do-${command.id}`}
      onClick={command.run}
      disabled={remote && link.value.phase !== "open"}
      {...(pressed === undefined ? {} : { "aria-pressed": pressed })}
    >
      {label ?? command.label} <kbd>{command.key}</kbd>
    </button>
  );
}

/** The force of what is held now, else of the next press. */
function Force() {
  const { held, probe } = hand.value;
  const force = held.find((press) => press.pointer !== null)?.force ?? probe.force;
  const step = (command: Command, name: string) => (
    <button type="button" title={command.title} aria-label={name} onClick={command.run}>
      {command.label}
    </button>
  );
  return (
    <div class="force" role="group" aria-label="Force">
      <span>Press with</span>
      {step(commands.softer, "Less force")}
      <output>{fixed(force, 1)} N</output>
      {step(commands.harder, "More force")}
    </div>
  );
}

/** On a telephone the rest of the buttons stand behind one. */
const unfolded = signal(false);

/** What Space does: hold, go on, or play a recording again from its beginning. */
function pauseLabel(): string {
  if (status.value?.replay?.ended) return "Play again";
  return status.value?.paused ? "Go on" : "Pause";
}

export function Controls() {
  const pressable = scene.value?.pressable ?? false;
  const paused = status.value?.paused ?? false;
  const recording = status.value?.recording != null;
  return (
    <footer class={`controls${unfolded.value ? " unfolded" : ""}`}>
      <div role="group" aria-label="Measurement">
        <Button remote command={commands.takeReference} />
        <Button
          remote
          command={commands.pause}
          pressed={paused}
          label={pauseLabel()}
        />
        <Button
          remote
          command={commands.record}
          pressed={recording}
          label={recording ? "End recording" : "Record"}
        />
        <button
          type="button"
          class="unfold"
          data-testid="do-unfold"
          aria-expanded={unfolded.value}
          onClick={() => (unfolded.value = !unfolded.value)}
        >
          {unfolded.value ? "Less" : "More"}
        </button>
      </div>
      {pressable && (
        <div role="group" aria-label="Pressing">
          <Force />
          <Button remote command={commands.keep} pressed={keepPresses.value} />
          <Button remote command={commands.lift} />
        </div>
      )}
      <div role="group" aria-label="View" class="views">
        <Button command={space} pressed={inSpace.value} />
        <Button remote command={relief} pressed={heights.value !== "off"} />
        <Button command={commands.flat} label={smoothed.value ? "Show cells" : "Smooth"} />
        {scene.value?.truth && <Button command={commands.truth} pressed={showTruth.value} />}
      </div>
    </footer>
  );
}
