/** The sheet's image in WebGL2: one static buffer of corners, one texture of values per frame. */

import { MAP_SIZE } from "../colours";
import type { Look, Picture } from "./picture";
import type { Seen } from "./solid";
import { compiled } from "./program";
import { toNodes, type Topology } from "./topology";

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
layout(location = 1) in float node;
layout(location = 2) in float light;
uniform vec4 view;
uniform float depth;
uniform highp sampler2D values;
uniform int row;
uniform bool smoothed;
out float value;
out float lit;
out vec3 corner;
void main() {
  lit = light;
  int index = smoothed ? int(node) : gl_VertexID / 3;
  value = texelFetch(values, ivec2(index % row, index / row), 0).r;
  int k = gl_VertexID % 3;
  corner = vec3(k == 0, k == 1, k == 2);
  gl_Position = vec4(place.xy * view.xy + view.zw, -place.z * depth, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D map;
uniform float limit;
uniform float size;
uniform vec4 mesh;
in float value;
in float lit;
in vec3 corner;
out vec4 colour;
void main() {
  float t = clamp(value / limit, -1.0, 1.0) * 0.5 + 0.5;
  vec3 shade = texture(map, vec2((t * (size - 1.0) + 0.5) / size, 0.5)).rgb;
  vec3 near = smoothstep(vec3(0.0), fwidth(corner) * 1.2, corner);
  float edge = 1.0 - min(min(near.x, near.y), near.z);
  vec3 level = mix(shade, mesh.rgb, edge * mesh.a);
  colour = vec4(mix(level * min(lit, 1.0), vec3(1.0), 0.35 * max(lit - 1.0, 0.0)), 1.0);
}`;

const ROW = 1024;

function makeTexture(gl: WebGL2RenderingContext, unit: number, filter: number): WebGLTexture {
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, side, filter);
  }
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
    gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  }
  return texture;
}

/** Three corners a cell: x, y, z, node, light; of the flat sheet, or of the sheet as it is seen. */
function cornerData({ cells, points }: Topology, seen: Seen | undefined): Float32Array {
  const corners = new Float32Array(5 * cells.length);
  cells.forEach((node, k) => {
    const at = 5 * k;
    corners[at] = seen ? seen.places[3 * node] : points[2 * node];
    corners[at + 1] = seen ? seen.places[3 * node + 1] : points[2 * node + 1];
    corners[at + 2] = seen ? seen.places[3 * node + 2] : 0;
    corners[at + 3] = node;
    corners[at + 4] = seen?.lit?.[node] ?? 1;
  });
  return corners;
}

/** The WebGL2 context of a canvas, or null where WebGL2 is missing. */
export function openGl(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  return canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });
}

/** Paints pictures in a fresh (or restored) context. */
export class GlPicture implements Picture {
  private readonly uniforms: Record<string, WebGLUniformLocation | null>;
  private topology: Topology | null = null;
  private values = new Float32Array(ROW);
  private map: Uint8Array | null = null;
  private seen: Seen | undefined;

  constructor(private readonly gl: WebGL2RenderingContext) {
    const program = compiled(gl, VERTEX, FRAGMENT);
    const at = (name: string) => gl.getUniformLocation(program, name);
    gl.useProgram(program);
    makeTexture(gl, 0, gl.NEAREST);
    makeTexture(gl, 1, gl.LINEAR);
    gl.uniform1i(at("values"), 0);
    gl.uniform1i(at("map"), 1);
    gl.uniform1i(at("row"), ROW);
    gl.uniform1f(at("size"), MAP_SIZE);
    this.uniforms = Object.fromEntries(
      ["view", "depth", "limit", "mesh", "smoothed"].map((name) => [name, at(name)]),
    );
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 20, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 1, gl.FLOAT, false, 20, 12);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribPointer(2, 1, gl.FLOAT, false, 20, 16);
    gl.enable(gl.DEPTH_TEST);
  }

  setTopology(topology: Topology): void {
    const { gl } = this;
    const rows = Math.ceil(Math.max(topology.nCells, topology.nPoints) / ROW);
    this.topology = topology;
    this.values = new Float32Array(rows * ROW);
    gl.activeTexture(gl.TEXTURE0);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, ROW, rows, 0, gl.RED, gl.FLOAT, this.values);
    this.placeCorners(topology, undefined);
  }

  /** The corners of another mesh, or of the sheet seen from elsewhere. */
  private placeCorners(topology: Topology, seen: Seen | undefined): void {
    const { gl } = this;
    this.seen = seen;
    gl.bufferData(gl.ARRAY_BUFFER, cornerData(topology, seen), gl.STATIC_DRAW);
  }

  paint(image: Float32Array, look: Look): void {
    const { gl, topology, uniforms } = this;
    if (!topology) return;
    const { scale, originX, originY, width, height, seen } = look.view;
    if (seen !== this.seen) this.placeCorners(topology, seen);
    gl.uniform1f(uniforms.depth, seen ? 0.7 / seen.radius : 0);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.uniform4f(
      uniforms.view,
      (2 * scale) / width,
      (2 * scale) / height,
      (2 * originX) / width - 1,
      1 - (2 * originY) / height,
    );
    gl.uniform1f(uniforms.limit, look.limit);
    gl.uniform1i(uniforms.smoothed, look.smoothed ? 1 : 0);
    const [red, green, blue, strength] = look.mesh;
    gl.uniform4f(uniforms.mesh, red, green, blue, look.smoothed ? 0 : strength);
    this.uploadMap(look.map);
    this.uploadValues(topology, image, look.smoothed);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * topology.nCells);
  }

  private uploadMap(map: Uint8Array): void {
    if (this.map === map) return;
    const { gl } = this;
    this.map = map;
    gl.activeTexture(gl.TEXTURE1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, MAP_SIZE, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, map);
  }

  private uploadValues(topology: Topology, image: Float32Array, smoothed: boolean): void {
    const { gl, values } = this;
    if (smoothed) toNodes(topology, image, values);
    else values.set(image);
    gl.activeTexture(gl.TEXTURE0);
    const rows = values.length / ROW;
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, rows, gl.RED, gl.FLOAT, values);
  }
}
