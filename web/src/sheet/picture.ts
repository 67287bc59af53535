/** What paints the image of conductivity change: WebGL2, or flat triangles where that is missing. */

import { mapIndex } from "../colours";
import type { Topology } from "./topology";
import { toPixels, type View } from "./view";

export interface Look {
  readonly view: View;
  /** Symmetric colour limit, in the image's unit. */
  readonly limit: number;
  readonly smoothed: boolean;
  readonly map: Uint8Array;
  /** Red, green, blue and strength of the mesh lines of the flat picture, 0…1. */
  readonly mesh: readonly [number, number, number, number];
}

export interface Picture {
  setTopology(topology: Topology): void;
  /** Paint one value per cell. */
  paint(image: Float32Array, look: Look): void;
}

/** Flat triangles on a 2D canvas: the same picture, unsmoothed and slower. */
export function flatPicture(canvas: HTMLCanvasElement): Picture {
  const context = canvas.getContext("2d");
  let topology: Topology | null = null;
  return {
    setTopology(next) {
      topology = next;
    },
    paint(image, { view, limit, map }) {
      if (!context || !topology) return;
      const { points, cells, nCells } = topology;
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, canvas.width, canvas.height);
      const density = canvas.width / view.width;
      context.setTransform(density, 0, 0, density, 0, 0);
      context.lineWidth = 0.6;
      for (let c = 0; c < nCells; c++) {
        const k = 4 * mapIndex(image[c], limit);
        const colour = `rgb(${map[k]} ${map[k + 1]} ${map[k + 2]})`;
        context.fillStyle = colour;
        context.strokeStyle = colour;
        context.beginPath();
        for (let corner = 0; corner < 3; corner++) {
          const node = cells[3 * c + corner];
          context.lineTo(...toPixels(view, points[2 * node], points[2 * node + 1]));
        }
        context.closePath();
        context.fill();
        context.stroke();
      }
    },
  };
}
