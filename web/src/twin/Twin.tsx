/** The twin drawer: the probe and its presses, how the sheet is bent, and what is broken. */

import { addDrawer } from "../drawers";
import { scene } from "../state";
import { Bends } from "./Bends";
import { Broken } from "./Broken";
import { twin } from "./model";
import { Presses } from "./Presses";
import { Probes } from "./Probes";

function View() {
  return (
    <div class="twin">
      <Probes />
      <Presses />
      {twin.value.bendable && <Bends />}
      {twin.value.breakable && <Broken />}
    </div>
  );
}

addDrawer({
  id: "twin",
  label: "Twin",
  key: "W",
  title: "Probe, presses, bends and faults of the simulated skin",
  offered: () => scene.value?.pressable ?? false,
  View,
});
