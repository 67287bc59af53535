/** The right of the page: touches and their strength, and below them the voltages or a drawer. */

import { useEffect, useRef } from "preact/hooks";
import { closeDrawer, type Drawer, drawers, opened, toggleDrawer } from "../drawers";
import { narrow } from "../screen";
import { Strength } from "./Strength";
import { Touches } from "./Touches";
import { Voltages } from "./Voltages";

function Tab({ drawer }: { drawer: Drawer }) {
  const { id, key, label, title } = drawer;
  const open = opened.value?.id === id;
  return (
    <button
      type="button"
      data-testid={`open-${id}`}
      aria-expanded={open}
      {...(open ? { "aria-controls": "drawer" } : {})}
      title={`${title} (${key})`}
      onClick={() => toggleDrawer(id)}
    >
      {label}
    </button>
  );
}

function OpenDrawer({ drawer }: { drawer: Drawer }) {
  const box = useRef<HTMLElement>(null);
  useEffect(() => {
    const before = document.activeElement;
    box.current?.focus();
    if (narrow.peek()) box.current?.scrollIntoView();
    // Whoever opened it with a button goes on from there.
    return () => {
      if (before instanceof HTMLElement && before.isConnected) before.focus({ preventScroll: true });
    };
  }, [drawer.id]);
  const { View } = drawer;
  return (
    <section
      ref={box}
      id="drawer"
      class="drawer"
      data-testid={`drawer-${drawer.id}`}
      aria-labelledby="drawer-title"
      tabIndex={-1}
      onKeyDown={(event) => {
        if (event.key !== "Escape") return;
        event.stopPropagation();
        closeDrawer();
      }}
    >
      <header>
        <h2 id="drawer-title">{drawer.label}</h2>
        <button type="button" aria-label={`Close ${drawer.label}`} onClick={closeDrawer}>
          Close
        </button>
      </header>
      <div class="drawn">
        <View />
      </div>
    </section>
  );
}

export function Side() {
  const drawer = opened.value;
  return (
    <div class="side">
      <div class="upper">
        <Touches />
        <Strength />
      </div>
      <div class="lower">
        <nav class="tabs" aria-label="Drawers">
          <button type="button" aria-expanded={drawer === null} onClick={closeDrawer}>
            Voltages
          </button>
          {drawers.value.map((each) => (
            <Tab key={each.id} drawer={each} />
          ))}
        </nav>
        {drawer ? <OpenDrawer key={drawer.id} drawer={drawer} /> : <Voltages />}
      </div>
    </div>
  );
}
