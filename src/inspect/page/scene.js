// The points in space, on the plane and in the range image. All views are parts of one canvas that
// lies below the page, so that they share one buffer of points: one draw call a view. Nothing is
// made anew while a view turns.

import { Rasterizer, isSoftware } from "inspect/rasterizer";

const POINTS = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 colour;
uniform mat4 matrix;
uniform vec3 sizes;
out vec3 tint;
void main() {
  gl_Position = colour.a == 0.0 ? vec4(2.0, 2.0, 2.0, 1.0) : matrix * vec4(position, 1.0);
  gl_PointSize = colour.a < 0.5 ? sizes.x : colour.a < 0.9 ? sizes.y : sizes.z;
  tint = colour.rgb;
}`;
const TINT = `#version 300 es
precision mediump float;
in vec3 tint;
out vec4 colour;
void main() { colour = vec4(tint, 1.0); }`;
const LINES = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 colour;
uniform mat4 matrix;
out vec3 tint;
void main() { gl_Position = matrix * vec4(position, 1.0); tint = colour.rgb; }`;
const IMAGE = `#version 300 es
uniform vec4 part;
out vec2 place;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  place = part.xy + part.zw * vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}`;
const PIXEL = `#version 300 es
precision mediump float;
uniform sampler2D image;
in vec2 place;
out vec4 colour;
void main() { colour = texture(image, place); }`;

export class Scene {
  constructor(canvas, panel) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", {
      alpha: true,
      antialias: false,
      premultipliedAlpha: true,
      preserveDrawingBuffer: true,
    });
    if (!this.gl) throw new Error("this browser has no WebGL 2, which the views are drawn with");
    this.panel = panel.map((x) => x / 255);
    this.slots = {};
    this.positions = null;
    this.build();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.build();
      this.onRestored?.();
    });
  }

  build() {
    const { gl } = this;
    this.slots = {};
    this.points = this.program(POINTS, TINT, ["matrix", "sizes"]);
    this.lines = this.program(LINES, TINT, ["matrix"]);
    this.image = this.program(IMAGE, PIXEL, ["part", "image"]);
    this.empty = gl.createVertexArray();
    this.position = gl.createBuffer();
    this.most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    this.rasterizer = isSoftware(gl) ? new Rasterizer(gl, this.program.bind(this)) : null;
    gl.enable(gl.SCISSOR_TEST);
  }

  program(vertex, fragment, uniforms) {
    const { gl } = this,
      program = gl.createProgram();
    for (const [kind, text] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS))
      throw new Error(gl.getProgramInfoLog(program));
    return {
      program,
      ...Object.fromEntries(uniforms.map((name) => [name, gl.getUniformLocation(program, name)])),
    };
  }

  slot(name) {
    const { gl } = this;
    if (!this.slots[name]) {
      const own = {
        colour: gl.createBuffer(),
        array: gl.createVertexArray(),
        texture: gl.createTexture(),
        line: gl.createBuffer(),
        lineColour: gl.createBuffer(),
        lineArray: gl.createVertexArray(),
        lineCount: 0,
        size: [0, 0],
      };
      gl.bindVertexArray(own.array);
      this.attribute(0, this.position, 3, gl.FLOAT);
      this.attribute(1, own.colour, 4, gl.UNSIGNED_BYTE);
      gl.bindVertexArray(own.lineArray);
      this.attribute(0, own.line, 3, gl.FLOAT);
      this.attribute(1, own.lineColour, 4, gl.UNSIGNED_BYTE);
      this.slots[name] = own;
    }
    return this.slots[name];
  }

  attribute(place, buffer, size, type) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, type !== gl.FLOAT, 0, 0);
  }

  // The points of a cloud; what is not finite lies at the origin and is never drawn.
  setPoints(positions) {
    const { gl } = this,
      clean = new Float32Array(positions.length);
    for (let n = 0; n < clean.length; n++)
      clean[n] = Number.isFinite(positions[n]) ? positions[n] : 0;
    this.count = clean.length / 3;
    this.clean = clean;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.position);
    gl.bufferData(gl.ARRAY_BUFFER, clean, gl.STATIC_DRAW);
  }

  // The colours of all points in a slot, and the range image that they make.
  setColours(name, colours, { rows, columns, top_row_first: topFirst }, pointOfPixel) {
    const { gl } = this,
      own = this.slot(name);
    gl.bindBuffer(gl.ARRAY_BUFFER, own.colour);
    gl.bufferData(gl.ARRAY_BUFFER, colours, gl.DYNAMIC_DRAW);
    // Of more columns than a texture has room for, each second or third.
    const stride = Math.ceil(columns / this.most),
      width = Math.ceil(columns / stride);
    const size = width * rows;
    if (own.pixels?.length !== size) own.pixels = new Uint32Array(size);
    const source = new Uint32Array(colours.buffer, colours.byteOffset, colours.length / 4);
    own.source = source;
    const [r, g, b] = this.panel.map((x) => Math.round(x * 255)),
      empty = (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;
    for (let row = 0, at = 0; row < rows; row++) {
      const from = (topFirst ? row : rows - 1 - row) * columns;
      for (let column = 0; column < columns; column += stride, at++) {
        const point = pointOfPixel[from + column];
        own.pixels[at] = point === 0xffffffff ? empty : (source[point] | 0xff000000) >>> 0;
      }
    }
    gl.bindTexture(gl.TEXTURE_2D, own.texture);
    gl.texImage2D(
      gl.TEXTURE_2D,
      0,
      gl.RGBA,
      width,
      rows,
      0,
      gl.RGBA,
      gl.UNSIGNED_BYTE,
      new Uint8Array(own.pixels.buffer),
    );
    for (const [name, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.NEAREST],
      [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
    ])
      gl.texParameteri(gl.TEXTURE_2D, name, value);
  }

  // Lines of a slot: pairs of ends with a colour each.
  setLines(name, ends, colours) {
    const { gl } = this,
      own = this.slot(name);
    own.lineCount = ends.length / 3;
    gl.bindBuffer(gl.ARRAY_BUFFER, own.line);
    gl.bufferData(gl.ARRAY_BUFFER, ends, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, own.lineColour);
    gl.bufferData(gl.ARRAY_BUFFER, colours, gl.DYNAMIC_DRAW);
  }

  // Begins a picture of that size; what is not drawn again stays, unless all is.
  begin(width, height, isAll) {
    const { gl, canvas } = this,
      isOther = canvas.width !== width || canvas.height !== height;
    if (isOther) Object.assign(canvas, { width, height });
    if (!isOther && !isAll) return;
    gl.scissor(0, 0, width, height);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  // Clears an area; returns it as WebGL counts, upwards from below.
  area({ x, y: top, width, height }) {
    const { gl, canvas } = this,
      y = canvas.height - top - height;
    gl.viewport(x, y, width, height);
    gl.scissor(x, y, width, height);
    gl.clearColor(...this.panel, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    return { x, y, width, height };
  }

  drawPoints(name, area, matrix, scale, withLines) {
    const { gl } = this,
      own = this.slots[name],
      cleared = this.area(area);
    if (!own || !this.count) return;
    gl.enable(gl.DEPTH_TEST);
    if (this.rasterizer) {
      const points = { positions: this.clean, colours: own.source, count: this.count };
      this.rasterizer.draw(cleared, points, matrix, scale);
    } else {
      gl.useProgram(this.points.program);
      gl.uniformMatrix4fv(this.points.matrix, false, matrix);
      gl.uniform3f(this.points.sizes, ...scale);
      gl.bindVertexArray(own.array);
      gl.drawArrays(gl.POINTS, 0, this.count);
    }
    if (withLines && own.lineCount) {
      gl.useProgram(this.lines.program);
      gl.uniformMatrix4fv(this.lines.matrix, false, matrix);
      gl.bindVertexArray(own.lineArray);
      gl.drawArrays(gl.LINES, 0, own.lineCount);
    }
  }

  drawImage(name, area, { x, y, zoom }) {
    const { gl } = this,
      own = this.slots[name];
    this.area(area);
    if (!own?.pixels) return;
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(this.image.program);
    gl.uniform4f(this.image.part, x - 0.5 / zoom, y - 0.5 / zoom, 1 / zoom, 1 / zoom);
    gl.bindTexture(gl.TEXTURE_2D, own.texture);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}
