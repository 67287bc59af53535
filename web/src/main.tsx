/** Where the page starts. */

import "./styles/tokens.css";
import "./styles/typeface.css";
import "./styles/page.css";
import "./styles/sheet.css";
import "./styles/panels.css";
import "./styles/drawers.css";
import "./styles/forms.css";
import "./styles/signals.css";
import "./styles/flows.css";
import "./styles/narrow.css";
import { effect } from "@preact/signals";
import { render } from "preact";
import { App } from "./App";
import { onClick, onKey } from "./commands";
import "./flows/SetUp";
import "./flows/Sessions";
import { startHolding } from "./hold";
import { installHook } from "./hook";
import { startTelling } from "./latency";
import "./twin/Twin";
import "./signals/Signals";
import "./settings/Settings";
import { scene, start } from "./state";
import { typeface } from "./theme";

start(); // the server answers while the page is laid out
await typeface(); // so that nothing moves when it comes, and canvases have it from the first
const page = document.getElementById("page");
if (page) render(<App />, page);
window.addEventListener("keydown", onKey);
window.addEventListener("click", onClick);
effect(() => {
  document.title = scene.value ? `${scene.value.skin.name} · tomoskin` : "tomoskin";
});
installHook();
startHolding();
startTelling();
