/** Faces of probes: how they are told to the server, and how they look from above. */

import type { PressRequest } from "./wire";

export type Corner = readonly [number, number];

export interface Face {
  readonly id: string;
  readonly label: string;
  readonly shape: "circle" | "square" | "finger" | "polygon";
  /** Of a polygon, in parts of half its size. */
  readonly corners?: readonly Corner[];
}

export const CIRCLE: Face = { id: "circle", label: "Circle", shape: "circle" };

export const FACES: readonly Face[] = [
  CIRCLE,
  { id: "square", label: "Square", shape: "square" },
  { id: "finger", label: "Finger", shape: "finger" },
  {
    id: "triangle",
    label: "Triangle",
    shape: "polygon",
    corners: [
      [0, 1],
      [-0.866, -0.5],
      [0.866, -0.5],
    ],
  },
  {
    id: "bar",
    label: "Bar",
    shape: "polygon",
    corners: [
      [1, 0.25],
      [-1, 0.25],
      [-1, -0.25],
      [1, -0.25],
    ],
  },
];

/** Of a fingertip: its width in parts of its length. */
const SLIM = 16 / 22;
const AROUND = 48;

/** The rim in parts of half the size, untilted. */
function rimOf({ shape, corners }: Face): readonly Corner[] {
  if (corners) return corners;
  if (shape === "square") {
    return [
      [1, 1],
      [-1, 1],
      [-1, -1],
      [1, -1],
    ];
  }
  const slim = shape === "finger" ? SLIM : 1;
  return Array.from({ length: AROUND }, (_, k) => {
    const angle = (2 * Math.PI * k) / AROUND;
    return [Math.cos(angle), slim * Math.sin(angle)] as const;
  });
}

/** Corners of a face of half size `radius`, turned by `angle`, around the probe's middle. */
export function rim(face: Face, radius: number, angle: number): readonly Corner[] {
  const [c, s] = [radius * Math.cos(angle), radius * Math.sin(angle)];
  return rimOf(face).map(([x, y]) => [c * x - s * y, s * x + c * y] as const);
}

/** What the server is told of a face beside place, force and half size; nothing for a circle. */
export function faceMessage(face: Face, radius: number, angle: number): Partial<PressRequest> {
  if (face.shape === "circle") return {};
  const { shape, corners } = face;
  const vertices = corners?.map(([x, y]) => [x * radius, y * radius] as const);
  return { shape, angle, ...(vertices ? { vertices } : {}) };
}
