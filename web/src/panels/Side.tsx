/** The right of the page: its tabs, the panels, and the drawer that lies over the panels. */

import { useEffect, useRef } from "preact/hooks";
import { closeDrawer, type Drawer, drawers, opened, toggleDrawer } from "../drawers";
import { Strength } from "./Strength";
import { Touches } from "./Touches";
import { Voltages } from "./Voltages";

function Tab({ drawer }: { drawer: Drawer }) {
  const { id, key, label, title } = drawer;
  return (
    <button
      type="button"
      data-testid={`open-${id}`}
      aria-expanded={opened.value?.id === id}
      aria-controls="drawer"
      title={`${title} (${key})`}
      onClick={() => toggleDrawer(id)}
    >
      {label}
    </button>
  );
}

function OpenDrawer({ drawer }: { drawer: Drawer }) {
  const box = useRef<HTMLElement>(null);
  useEffect(() => box.current?.focus(), [drawer.id]);
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
      <nav class="tabs" aria-label="Drawers">
        <button type="button" aria-expanded={drawer === null} onClick={closeDrawer}>
          Now
        </button>
        {drawers.value.map((each) => (
          <Tab key={each.id} drawer={each} />
        ))}
      </nav>
      <div class="panels" {...(drawer ? { inert: true } : {})}>
        <Touches />
        <Voltages />
        <Strength />
      </div>
      {drawer && <OpenDrawer key={drawer.id} drawer={drawer} />}
    </div>
  );
}
