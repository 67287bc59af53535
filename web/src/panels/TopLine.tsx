/** The top line: the state as a word, the skin, what happens or what to act on, the figures. */

import { signal } from "@preact/signals";
import { flow, opening } from "../flows/model";
import { doing, progress, settings } from "../settings/model";
import { answered, connection, link, newest, notice, now, scene, send, status } from "../state";
import { facts, headline, type Warning } from "../words";

const unfolded = signal(false);

function age(): number | null {
  return newest.count ? now.value - newest.arrived : null;
}

/** The skin, to be changed for another of the folder or a built-in one. */
function Skin() {
  const name = scene.value?.skin.name;
  if (!name) return null;
  const offered = settings.value ? [...settings.value.files, ...settings.value.builtin] : [];
  const others = [...new Set(offered)].filter((each) => each !== name);
  if (!others.length) return <span class="skin">{name}</span>;
  const fixed = status.value?.replay != null;
  return (
    <select
      class="skin"
      data-testid="skin"
      aria-label="Skin"
      title={fixed ? "A recording keeps the skin that it was made with" : "Change the skin"}
      disabled={fixed || link.value.phase !== "open"}
      value=""
      onChange={({ currentTarget }) => {
        if (currentTarget.value) send({ type: "load_skin", name: currentTarget.value });
        currentTarget.value = "";
      }}
    >
      <option value="">{name}</option>
      {others.map((each) => (
        <option key={each}>{each}</option>
      ))}
    </select>
  );
}

/** The name of the skin on its robot, whose page is two folders up; null where it stands alone. */
const part = /\/skin\/([^/]+)\/$/.exec(window.location.pathname)?.[1] ?? null;

/** The first warning on one line; it opens the list of all. */
function Warnings({ warnings }: { readonly warnings: readonly Warning[] }) {
  const more = warnings.length - 1;
  return (
    <button
      type="button"
      class="warning"
      data-testid="warning"
      aria-expanded={unfolded.value}
      aria-controls="warnings"
      title={warnings.map(({ text }) => text).join("\n")}
      onClick={() => (unfolded.value = !unfolded.value)}
    >
      <span class="first">{warnings[0].text}</span>
      {more > 0 && <span class="more">+ {more} more</span>}
    </button>
  );
}

/** What happens, where nobody has to act; or the answer to what was just done. */
function Remark({ text }: { readonly text: string }) {
  const change = settings.value?.busy && progress.value ? `Changing the skin: ${doing(progress.value)}` : "";
  const said = notice.value ?? "";
  const shown = (answered.value && said) || text || change || said || scene.value?.source || "";
  return (
    <span class="remarked" data-testid="remark" title={shown}>
      {shown}
    </span>
  );
}

export function TopLine() {
  const { word, remark, warnings } = headline(
    link.value, scene.value, status.value, now.value, age(), flow.value, opening.value,
  );
  const lost = link.value.phase === "lost";
  const act = warnings.length > 0;
  return (
    <header class={`top${act ? " act" : ""}`}>
      <h1 class="unseen">tomoskin, {scene.value?.skin.name}</h1>
      <p class="unseen" role="status">
        {[word, ...warnings.map(({ brief }) => brief)].join(". ")}
      </p>
      <p class="state" data-testid="state">
        <span class="lamp" aria-hidden="true" />
        <strong>{word}</strong>
      </p>
      {part !== null && (
        <a class="button" href="../../" title="All skins of the robot" data-testid="robot">
          ‹ {decodeURIComponent(part)}
        </a>
      )}
      <Skin />
      {act && !answered.value ? <Warnings warnings={warnings} /> : <Remark text={remark} />}
      {lost && (
        <button type="button" onClick={() => connection.open()}>
          Try now
        </button>
      )}
      <dl class="facts">
        {!lost &&
          facts(status.value).map((fact) => (
            <div key={fact.id} title={fact.title}>
              <dd data-testid={fact.id}>{fact.value}</dd>
              <dt>{fact.name}</dt>
            </div>
          ))}
      </dl>
      {act && unfolded.value && (
        <ul class="warnings" id="warnings" aria-label="Warnings" data-testid="warnings">
          {warnings.map((each) => (
            <li key={each.brief}>{each.text}</li>
          ))}
        </ul>
      )}
    </header>
  );
}
