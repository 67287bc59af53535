/** The page: a line of state, the sheet, its panels and drawers, the commands. */

import { TimeLine } from "./flows/TimeLine";
import { ReadingsBesideSheet } from "./panels/Readings";
import { Controls } from "./panels/Controls";
import { Legend } from "./panels/Legend";
import { Side } from "./panels/Side";
import { TopLine } from "./panels/TopLine";
import { Sheet } from "./sheet/Sheet";

export function App() {
  return (
    <>
      <TopLine />
      <main>
        <Sheet />
        <div class="beside">
          <Legend />
          <ReadingsBesideSheet />
        </div>
        <Side />
      </main>
      <TimeLine />
      <Controls />
    </>
  );
}
