/** The page: a line of state, the sheet, its panels, the commands. */

import { Controls } from "./panels/Controls";
import { Legend } from "./panels/Legend";
import { Strength } from "./panels/Strength";
import { TopLine } from "./panels/TopLine";
import { Touches } from "./panels/Touches";
import { Voltages } from "./panels/Voltages";
import { Sheet } from "./sheet/Sheet";

export function App() {
  return (
    <>
      <TopLine />
      <main>
        <Sheet />
        <Legend />
        <div class="panels">
          <Touches />
          <Voltages />
          <Strength />
        </div>
      </main>
      <Controls />
    </>
  );
}
