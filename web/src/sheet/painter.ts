/** Paints the newest frame on the sheet's two canvases, once per displayed frame at most. */

import { hand, history, limit, newest, scene, showTruth, smoothed, timed, topology } from "../state";
import { drewNewest } from "../latency";
import { AMOUNTS, painted } from "../signals/unresolved";
import { theme } from "../theme";
import { twin } from "../twin/model";
import { GlPicture, openGl } from "./gl";
import { drawMarks } from "./overlay";
import { flatPicture, type Picture } from "./picture";
import { cursor } from "./pointer";
import { dented } from "./relief";
import type { Topology } from "./topology";
import type { View } from "./view";

/** "#rrggbb" and a strength as four numbers 0…1. */
function channels(colour: string, strength: number): readonly [number, number, number, number] {
  const bits = Number.parseInt(colour.slice(1), 16);
  return [((bits >> 16) & 255) / 255, ((bits >> 8) & 255) / 255, (bits & 255) / 255, strength];
}

export class Painter {
  /** False: WebGL2 is missing and the picture is drawn flat. */
  readonly accelerated: boolean;
  private picture: Picture;
  private painted: Topology | null = null;
  private planned = 0;
  private readonly pen: CanvasRenderingContext2D | null;
  private untouched = new Float32Array();

  constructor(
    private readonly image: HTMLCanvasElement,
    private readonly marks: HTMLCanvasElement,
    private readonly view: () => View,
  ) {
    const gl = openGl(image);
    this.accelerated = gl !== null;
    this.picture = gl ? new GlPicture(gl) : flatPicture(image);
    this.pen = marks.getContext("2d");
    image.addEventListener("webglcontextlost", (event) => event.preventDefault());
    image.addEventListener("webglcontextrestored", () => {
      if (gl) this.picture = new GlPicture(gl);
      this.painted = null;
      this.request();
    });
  }

  /** Paint at the next displayed frame. */
  request = (): void => {
    this.planned ||= requestAnimationFrame(this.paint);
  };

  stop(): void {
    cancelAnimationFrame(this.planned);
  }

  /** Give the canvases as many pixels as the screen has there. */
  resize(width: number, height: number): void {
    const density = Math.min(2, window.devicePixelRatio || 1);
    for (const canvas of [this.image, this.marks]) {
      canvas.width = Math.round(width * density);
      canvas.height = Math.round(height * density);
    }
    this.request();
  }

  private readonly paint = timed(() => {
    this.planned = 0;
    const shape = topology.peek();
    const frame = newest.frame;
    const view = dented(this.view(), frame);
    if (!shape || view.width === 0) return;
    if (shape !== this.painted) {
      this.picture.setTopology(shape);
      this.untouched = new Float32Array(shape.nCells);
      this.painted = shape;
    }
    const colours = theme.peek();
    const open = painted.peek();
    this.picture.paint(open ?? frame?.image ?? this.untouched, {
      view,
      limit: open ? 1 : limit.peek(),
      smoothed: smoothed.peek(),
      map: open ? AMOUNTS : colours.map,
      mesh: channels(colours.mesh, 0.22),
    });
    if (!this.pen) return;
    const marks = {
      touches: frame?.touches ?? [],
      trails: frame?.touches.map((touch) => history.trailOf(touch.id)) ?? [],
      labels: frame?.labels ?? new Uint8Array(),
      truths: showTruth.peek() ? (frame?.truths ?? []) : null,
      held: hand.peek().held,
      cursor: cursor.peek(),
      smoothed: smoothed.peek(),
      outline: scene.peek()?.outline ?? [],
      deformation: frame?.referenceReady ? frame.deformation : null,
      trueDeformation: showTruth.peek() ? twin.peek() : null,
    };
    drawMarks(this.pen, colours, view, shape, marks, scene.peek()?.probe.max_force_n ?? 1, scene.peek()?.same);
    drewNewest();
  });
}
