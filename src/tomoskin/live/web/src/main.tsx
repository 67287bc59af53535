/** Where the page starts. */

import "./tokens.css";
import "./page.css";
import { render } from "preact";
import { App } from "./App";
import { onKey } from "./commands";
import { startHolding } from "./hold";
import { installHook } from "./hook";
import { start } from "./state";

const page = document.getElementById("page");
if (page) render(<App />, page);
window.addEventListener("keydown", onKey);
installHook();
startHolding();
start();
