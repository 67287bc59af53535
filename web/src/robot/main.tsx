/** Where the page of a whole robot starts. */

import "../styles/tokens.css";
import "../styles/typeface.css";
import "../styles/page.css";
import "../styles/robot.css";
import { effect, signal } from "@preact/signals";
import { render } from "preact";
import { Connection, type LinkState, socketAddress } from "../socket";
import { typeface } from "../theme";
import type { RobotMessage, RobotTouches } from "../wire";
import { follow, robot, states } from "./model";
import { Skins } from "./Skins";
import { Space } from "./Space";

const link = signal<LinkState>({ phase: "connecting" });
const error = signal<string | null>(null);

const connection = new Connection<RobotMessage>(socketAddress(window.location), {
  message(message) {
    if (message.type === "robot") robot.value = message;
    else if (message.type === "robot-state") states.value = message;
    else error.value = message.message;
  },
  frame(bytes) {
    follow(JSON.parse(new TextDecoder().decode(bytes)) as RobotTouches);
  },
  link(state) {
    link.value = state;
  },
});

function Line() {
  const lost = link.value.phase === "lost";
  const ill = Object.values(states.value?.skins ?? {}).filter((skin) => skin.problem !== null).length;
  const words = lost
    ? "The program does not answer: what is shown is old."
    : ill > 0
      ? `${ill} of ${robot.value?.skins.length ?? 0} skins need a look.`
      : "All skins are well.";
  return (
    <header class={`state${lost || ill > 0 ? " amber" : ""}`}>
      <h1>{robot.value?.name ?? "tomoskin"}</h1>
      <p role="status" data-testid="robot-line">
        {error.value ?? words}
      </p>
    </header>
  );
}

function Bar() {
  const recording = states.value?.recording ?? null;
  const off = link.value.phase !== "open";
  const record = () => {
    connection.send({ type: "record", on: recording === null });
  };
  return (
    <footer class="doings">
      <button type="button" disabled={off} data-testid="references" onClick={() => connection.send({ type: "reference" })}>
        Take all references
      </button>
      <button
        type="button"
        disabled={off}
        data-testid="record-all"
        aria-pressed={recording !== null}
        onClick={record}
      >
        {recording === null ? "Record all" : "End recording"}
      </button>
      <span>{recording ?? ""}</span>
    </footer>
  );
}

connection.open();
await typeface();
const page = document.getElementById("page");
if (page) {
  render(
    <>
      <Line />
      <main class="robot">
        <Space />
        <Skins />
      </main>
      <Bar />
    </>,
    page,
  );
}
effect(() => {
  document.title = robot.value ? `${robot.value.name} · tomoskin` : "tomoskin";
});
