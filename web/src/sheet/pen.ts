/** What marks over the image are drawn with. */

import type { Theme } from "../theme";
import { toPixels, type View } from "./view";

export type Pen = CanvasRenderingContext2D;
export type Place = readonly [number, number];

/** A line that reads on any colour: a wide halo under it. */
export function haloed(
  pen: Pen,
  theme: Theme,
  path: Path2D,
  colour: string,
  width: number,
  dashes: number[] = [],
): void {
  pen.setLineDash([]);
  pen.strokeStyle = theme.halo;
  pen.lineWidth = width + 2.5;
  pen.stroke(path);
  pen.setLineDash(dashes);
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.stroke(path);
}

/** Words that read on any colour, around a pixel. */
export function written(pen: Pen, theme: Theme, text: string, [x, y]: Place, colour: string): void {
  pen.font = `600 15px ${theme.font}`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.setLineDash([]);
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 4;
  pen.lineJoin = "round";
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

/** Draw nothing beyond the rim of the sheet, x0, y0, x1, y1, … m, while `draw` draws. */
export function within(pen: Pen, view: View, outline: readonly number[], draw: () => void): void {
  const path = new Path2D();
  for (let k = 0; k < outline.length; k += 2) {
    const [x, y] = toPixels(view, outline[k], outline[k + 1]);
    if (k) path.lineTo(x, y);
    else path.moveTo(x, y);
  }
  path.closePath();
  pen.save();
  if (outline.length > 0) pen.clip(path);
  draw();
  pen.restore();
}
