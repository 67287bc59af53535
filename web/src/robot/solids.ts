/** The robot's links and skins in WebGL2: one buffer of corners, shaded by the way their triangles look. */

import { compiled } from "../sheet/program";
import type { Theme } from "../theme";
import type { Camera } from "./model";

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
uniform mat3 turn;
uniform vec3 middle;
uniform vec3 scale;
out vec3 seen;
void main() {
  seen = (place - middle) * turn;
  gl_Position = vec4(seen * scale * vec3(1.0, 1.0, -1.0), 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 base;
uniform vec3 line;
uniform float radius;
in vec3 seen;
out vec4 colour;
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float near = 0.5 + 0.5 * clamp(seen.z / radius, -1.0, 1.0);
  colour = vec4(mix(line, base, 0.2 + 0.4 * abs(normal.z) + 0.4 * near), 1.0);
}`;

/** #rrggbb as parts of one; the build shortens some to #rgb. */
export function parts(colour: string): [number, number, number] {
  const full = colour.length === 4 ? colour.replace(/[^#]/g, "$&$&") : colour;
  return [1, 3, 5].map((k) => Number.parseInt(full.slice(k, k + 2), 16) / 255) as [number, number, number];
}

/** Paints triangles, the nearer over the farther. */
export class Solids {
  private readonly program: WebGLProgram;
  private ofLinks = 0;
  private ofSkins = 0;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = compiled(gl, VERTEX, FRAGMENT);
    gl.useProgram(this.program);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.polygonOffset(1, 1);
  }

  /** Corners of all triangles, x0, y0, z0, … */
  set(links: readonly number[], skins: readonly number[]): void {
    const corners = new Float32Array(links.length + skins.length);
    corners.set(links);
    corners.set(skins, links.length);
    this.ofLinks = links.length / 3;
    this.ofSkins = skins.length / 3;
    this.gl.bufferData(this.gl.ARRAY_BUFFER, corners, this.gl.STATIC_DRAW);
  }

  paint(camera: Camera, { halo, muted, line, mesh }: Theme): void {
    const { gl, program } = this;
    const at = (name: string) => gl.getUniformLocation(program, name);
    const { scale, width, height, radius } = camera;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.uniformMatrix3fv(at("turn"), false, camera.matrix);
    gl.uniform3fv(at("middle"), camera.middle);
    gl.uniform3f(at("scale"), (2 * scale) / width, (2 * scale) / height, 0.9 / radius);
    gl.uniform1f(at("radius"), radius);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const draw = (near: string, far: string, first: number, count: number) => {
      gl.uniform3fv(at("base"), parts(near));
      gl.uniform3fv(at("line"), parts(far));
      gl.drawArrays(gl.TRIANGLES, first, count);
    };
    gl.enable(gl.POLYGON_OFFSET_FILL); // a skin that lies on a link is seen
    draw(line, mesh, 0, this.ofLinks);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    draw(halo, muted, this.ofLinks, this.ofSkins);
  }
}
