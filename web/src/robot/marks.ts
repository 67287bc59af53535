/** What is drawn over the robot's skins: links, names, and touches with their numbers. */

import type { Theme } from "../theme";
import { type Camera, isFacing, type SkinTouches, toPicture, type World } from "./model";

const DOT = 7;
const ARROW = 0.03;

export function paintMarks(
  pen: CanvasRenderingContext2D,
  camera: Camera,
  world: World,
  names: readonly string[],
  found: SkinTouches,
  theme: Theme,
): void {
  pen.clearRect(0, 0, camera.width, camera.height);
  bones(pen, camera, world.bones, theme);
  world.skins.forEach((corners, k) => label(pen, camera, corners, names[k], theme));
  for (const { touches } of Object.values(found)) {
    for (const touch of touches) {
      const [x, y] = toPicture(camera, ...touch.position);
      const end = touch.position.map((value, k) => value + ARROW * touch.normal[k]) as [number, number, number];
      const [ex, ey] = toPicture(camera, ...end);
      pen.globalAlpha = isFacing(camera, touch.normal) ? 1 : 0.4;
      pen.strokeStyle = pen.fillStyle = theme.accent;
      pen.lineWidth = 2;
      line(pen, x, y, ex, ey);
      pen.beginPath();
      pen.arc(x, y, DOT, 0, 2 * Math.PI);
      pen.fill();
      pen.globalAlpha = 1;
      write(pen, `${touch.id}`, x + DOT + 9, y, theme, 600);
    }
  }
}

function bones(pen: CanvasRenderingContext2D, camera: Camera, ends: readonly number[], theme: Theme): void {
  pen.strokeStyle = theme.muted;
  pen.lineWidth = 3;
  for (let k = 0; k + 5 < ends.length; k += 6) {
    const [ax, ay] = toPicture(camera, ends[k], ends[k + 1], ends[k + 2]);
    const [bx, by] = toPicture(camera, ends[k + 3], ends[k + 4], ends[k + 5]);
    line(pen, ax, ay, bx, by);
  }
}

/** The name of a skin below its lowest corner in the picture. */
function label(
  pen: CanvasRenderingContext2D,
  camera: Camera,
  corners: readonly number[],
  name: string,
  theme: Theme,
): void {
  let [x, low] = [0, -Infinity];
  for (let k = 0; k < corners.length; k += 3) {
    const [px, py] = toPicture(camera, corners[k], corners[k + 1], corners[k + 2]);
    if (py > low) [x, low] = [px, py];
  }
  if (Number.isFinite(low)) write(pen, name, x, Math.min(low + 12, camera.height - 10), theme, 500);
}

function line(pen: CanvasRenderingContext2D, ax: number, ay: number, bx: number, by: number): void {
  pen.beginPath();
  pen.moveTo(ax, ay);
  pen.lineTo(bx, by);
  pen.stroke();
}

function write(
  pen: CanvasRenderingContext2D,
  text: string,
  x: number,
  y: number,
  theme: Theme,
  weight: number,
): void {
  pen.font = `${weight} 15px ${theme.font}`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 4;
  pen.lineJoin = "round";
  pen.strokeStyle = theme.halo;
  pen.strokeText(text, x, y);
  pen.fillStyle = theme.ink;
  pen.fillText(text, x, y);
}
