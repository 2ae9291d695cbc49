// Points drawn by the processor, for a browser without a graphics unit: software WebGL spends on a
// point what it spends on a triangle, many times what the loop below needs. The picture is the same
// to the pixel but for ties of depth.

const TINT = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}`;
const PIXEL = `#version 300 es
precision highp float;
uniform ivec2 corner;
uniform highp sampler2D tints, depths;
out vec4 colour;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) - corner;
  colour = texelFetch(tints, at, 0);
  if (colour.a == 0.0) discard;
  gl_FragDepth = 0.5 + 0.5 * texelFetch(depths, at, 0).r;
}`;

// Whether this context draws with the processor; no where the browser does not tell.
export function isSoftware(gl) {
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

export class Rasterizer {
  constructor(gl, program) {
    this.gl = gl;
    this.program = program(TINT, PIXEL, ["corner", "tints", "depths"]);
    this.array = gl.createVertexArray();
    this.textures = [gl.createTexture(), gl.createTexture()];
    for (const texture of this.textures) {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
        gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
    this.tints = new Uint32Array(0);
    this.depths = new Float32Array(0);
  }

  // Draws points into an area (in pixels, y upwards) of the canvas, with their depths.
  draw(area, points, matrix, sizes) {
    const { gl, program } = this,
      size = area.width * area.height;
    if (this.tints.length < size) {
      this.tints = new Uint32Array(size);
      this.depths = new Float32Array(size);
    }
    const tints = this.tints.subarray(0, size),
      depths = this.depths.subarray(0, size);
    tints.fill(0);
    depths.fill(1);
    rasterize({ ...area, tints, depths }, points, matrix, sizes);
    gl.useProgram(program.program);
    gl.uniform2i(program.corner, area.x, area.y);
    const bytes = new Uint8Array(tints.buffer, 0, 4 * size);
    this.upload(0, program.tints, area, [gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bytes]);
    this.upload(1, program.depths, area, [gl.R32F, gl.RED, gl.FLOAT, depths]);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  upload(unit, sampler, { width, height }, [own, format, type, values]) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
    gl.texImage2D(gl.TEXTURE_2D, 0, own, width, height, 0, format, type, values);
    gl.uniform1i(sampler, unit);
  }
}

// Each point is a square of pixels, the nearest wins: the rules of WebGL. The last byte of a colour
// says which of the sizes it has; 0 hides it.
function rasterize({ width, height, tints, depths }, { positions, colours, count }, matrix, sizes) {
  const [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = matrix;
  for (let point = 0, at = 0; point < count; point++, at += 3) {
    const colour = colours[point],
      shown = colour >>> 24;
    if (shown === 0) continue;
    const x = positions[at],
      y = positions[at + 1],
      z = positions[at + 2];
    const w = d * x + h * y + l * z + p,
      depth = (c * x + g * y + k * z + o) / w,
      right = (a * x + e * y + i * z + m) / w,
      up = (b * x + f * y + j * z + n) / w;
    // What is not within (behind the eye among it) is not drawn.
    if (!(w > 0 && depth >= -1 && depth <= 1 && right * right <= 1 && up * up <= 1)) continue;
    const half = sizes[shown < 128 ? 0 : shown < 230 ? 1 : 2] / 2,
      middle = (right * 0.5 + 0.5) * width - 0.5,
      across = (up * 0.5 + 0.5) * height - 0.5;
    const left = Math.max(Math.ceil(middle - half), 0),
      end = Math.min(Math.ceil(middle + half), width),
      bottom = Math.max(Math.ceil(across - half), 0),
      top = Math.min(Math.ceil(across + half), height);
    for (let row = bottom; row < top; row++) {
      for (let cell = row * width + left, last = row * width + end; cell < last; cell++) {
        if (depth >= depths[cell]) continue;
        depths[cell] = depth;
        tints[cell] = colour | 0xff000000;
      }
    }
  }
}
