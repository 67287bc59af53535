/** One line of state in words: what is shown, how it goes, and what someone must do. */

import { connection, link, newest, notice, now, scene, status } from "../state";
import { alpha, alphaInFull, facts, sentence } from "../words";

function age(): number | null {
  return newest.count ? now.value - newest.arrived : null;
}

export function TopLine() {
  const said = sentence(link.value, scene.value, status.value, now.value, age());
  const lost = link.value.phase === "lost";
  return (
    <header class={`top${said.act ? " act" : ""}`}>
      <h1 class="unseen">tomoskin, {scene.value?.skin.name}</h1>
      <p class="unseen" role="status">
        {said.brief}
      </p>
      <p class="state" data-testid="state">
        <span class="lamp" aria-hidden="true" />
        <strong>{said.text}</strong>
        {scene.value && !said.act && <span class="source" title={scene.value.source}>{scene.value.source}</span>}
        {status.value && !said.act && (
          <span class="alpha" data-testid="alpha" title={alphaInFull(status.value)}>
            {alpha(status.value)}
          </span>
        )}
        {notice.value && !said.act && (
          <span class="notice" title={notice.value}>
            {notice.value}
          </span>
        )}
        {lost && (
          <button type="button" onClick={() => connection.open()}>
            Try now
          </button>
        )}
      </p>
      <dl class="facts">
        {!lost &&
          facts(status.value).map((fact) => (
            <div key={fact.id} title={fact.title}>
              <dd data-testid={fact.id}>{fact.value}</dd>
              <dt>{fact.name}</dt>
            </div>
          ))}
      </dl>
    </header>
  );
}
