/** The robot in space; drag it, or use the arrow keys, to turn it. */

import { effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { theme } from "../theme";
import { paintMarks } from "./marks";
import { cameraOf, home, orbit, robot, touches, world } from "./model";
import { Solids } from "./solids";

const TURN = 0.008;
const STEP = 0.15;
const KEYS: Record<string, readonly [number, number]> = {
  ArrowLeft: [-STEP, 0],
  ArrowRight: [STEP, 0],
  ArrowUp: [0, -STEP],
  ArrowDown: [0, STEP],
};
const size = signal<readonly [number, number]>([0, 0]);

function turn(right: number, up: number): void {
  const now = orbit.peek();
  orbit.value = { turn: now.turn + right, tilt: Math.min(Math.PI - 0.05, Math.max(0.05, now.tilt + up)) };
}

function painting(image: HTMLCanvasElement, marks: HTMLCanvasElement): () => void {
  const gl = image.getContext("webgl2", { antialias: true });
  const pen = marks.getContext("2d");
  const solids = gl && new Solids(gl);
  const stops = [
    effect(() => {
      const now = world.value;
      solids?.set(now?.links ?? [], now?.skins.flat() ?? []);
    }),
    effect(() => {
      const [width, height] = size.value;
      const [scene, now, first] = [robot.value, world.value, home.value];
      if (!scene || !now || !first || !pen || width === 0) return;
      const fine = Math.min(2, window.devicePixelRatio || 1);
      for (const canvas of [image, marks]) {
        if (canvas.width !== Math.round(width * fine)) canvas.width = Math.round(width * fine);
        if (canvas.height !== Math.round(height * fine)) canvas.height = Math.round(height * fine);
      }
      pen.setTransform(fine, 0, 0, fine, 0, 0);
      const camera = cameraOf([...first.bones, ...first.links, ...first.skins.flat()], orbit.value, width, height);
      solids?.paint(camera, theme.value);
      const names = scene.skins.map((skin) => skin.name);
      paintMarks(pen, camera, now, names, touches.value, theme.value);
    }),
  ];
  return () => stops.forEach((stop) => stop());
}

export function Space() {
  const box = useRef<HTMLDivElement>(null);
  const image = useRef<HTMLCanvasElement>(null);
  const marks = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    if (!box.current || !image.current || !marks.current) return;
    const stop = painting(image.current, marks.current);
    const watched = new ResizeObserver(([entry]) => {
      size.value = [entry.contentRect.width, entry.contentRect.height];
    });
    watched.observe(box.current);
    return () => {
      watched.disconnect();
      stop();
    };
  }, []);
  const key = (event: KeyboardEvent) => {
    const step = KEYS[event.key];
    if (!step) return;
    event.preventDefault();
    turn(...step);
  };
  const drag = (event: PointerEvent) => {
    if (event.buttons) turn(TURN * event.movementX, -TURN * event.movementY);
  };
  return (
    <div
      ref={box}
      class="space"
      data-testid="space"
      tabIndex={0}
      role="application"
      aria-label="The robot with its skins. Arrow keys turn it."
      onKeyDown={key}
      onPointerDown={(event) => box.current?.setPointerCapture(event.pointerId)}
      onPointerMove={drag}
    >
      <canvas ref={image} />
      <canvas ref={marks} />
    </div>
  );
}
