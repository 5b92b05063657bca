// What WebGL draws: particles as lit balls (squares in the plane), boxes as lines.

const PARTICLES = {
  vertex: `#version 300 es
    precision highp float;
    precision highp int;
    layout(location = 0) in uvec4 place;
    layout(location = 1) in uint level;
    uniform mat4 matrix;
    uniform float resolution, half_width, doubling, pixels;
    uniform vec4 cut;
    uniform sampler2D table;
    uniform bool picking;
    flat out vec4 tint;
    void main() {
      vec3 at = vec3(place.xyz) * resolution;
      gl_Position = matrix * vec4(at, 1.0);
      gl_PointSize = max(2.0 * half_width * exp2(float(place.w) * doubling) * pixels / gl_Position.w, 1.5);
      vec4 colour = texelFetch(table, ivec2(int(level & 255u), int(level >> 8)), 0);
      if (dot(cut.xyz, at) > cut.w || colour.a == 0.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      uint id = uint(gl_VertexID);
      tint = picking ? vec4(id & 255u, id >> 8 & 255u, id >> 16 & 255u, id >> 24) / 255.0 : colour;
    }`,
  fragment: `#version 300 es
    precision highp float;
    flat in vec4 tint;
    uniform bool balls, picking;
    out vec4 colour;
    void main() {
      float light = 1.0;
      if (balls) {
        vec2 at = 2.0 * gl_PointCoord - 1.0;
        float square = dot(at, at);
        if (square > 1.0) discard;
        light = 0.45 + 0.6 * max(dot(vec3(at.x, -at.y, sqrt(1.0 - square)), vec3(-0.35, 0.5, 0.79)), 0.0);
      }
      colour = picking ? tint : vec4(tint.rgb * light, 1.0);
    }`,
};
const LINES = {
  vertex: `#version 300 es
    precision highp float;
    layout(location = 0) in vec3 corner;
    layout(location = 1) in vec3 low;
    layout(location = 2) in vec3 size;
    layout(location = 3) in vec3 tint;
    uniform mat4 matrix;
    uniform vec4 cut;
    flat out vec3 colour_of;
    void main() {
      gl_Position = matrix * vec4(low + size * corner, 1.0);
      if (dot(cut.xyz, low + 0.5 * size) > cut.w) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      colour_of = tint;
    }`,
  fragment: `#version 300 es
    precision highp float;
    flat in vec3 colour_of;
    out vec4 colour;
    void main() { colour = vec4(colour_of, 1.0); }`,
};
const NO_CUT = [0, 0, 0, 1];

class Scene {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) throw new Error("This page needs WebGL 2, which this browser does not offer. Try Firefox or Chromium with hardware acceleration.");
    this.canvas = canvas;
    this.gl = gl;
    this.particles = this.program(PARTICLES);
    this.lines = this.program(LINES);
    this.count = 0;
    this.place = gl.createBuffer();
    this.level = gl.createBuffer();
    this.ofParticles = gl.createVertexArray();
    gl.bindVertexArray(this.ofParticles);
    this.attribute(this.place, 0, 4, gl.UNSIGNED_SHORT, true);
    this.attribute(this.level, 1, 1, gl.UNSIGNED_SHORT, true);
    this.table = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    this.edges = this.buffer(edgesOfBox());
    this.tree = this.boxes();
    this.domain = this.boxes();
  }

  program({ vertex, fragment }) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`The graphics driver refuses a shader: ${gl.getProgramInfoLog(program)}`);
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i);
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    return { program, uniforms };
  }

  buffer(data) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return buffer;
  }

  attribute(buffer, location, size, type, integer) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(location);
    if (integer) gl.vertexAttribIPointer(location, size, type, 0, 0);
    else gl.vertexAttribPointer(location, size, type, false, 0, 0);
  }

  // Boxes to be drawn as lines: corner, size and colour of each.
  boxes() {
    const { gl } = this;
    const boxes = { array: gl.createVertexArray(), count: 0, parts: [0, 1, 2].map(() => gl.createBuffer()) };
    gl.bindVertexArray(boxes.array);
    this.attribute(this.edges, 0, 3, gl.FLOAT, false);
    boxes.parts.forEach((part, i) => {
      this.attribute(part, i + 1, 3, gl.FLOAT, false);
      gl.vertexAttribDivisor(i + 1, 1);
    });
    return boxes;
  }

  fill(buffer, data) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
  }

  setBoxes(boxes, corners, sizes, tints) {
    [corners, sizes, tints].forEach((data, i) => this.fill(boxes.parts[i], data));
    boxes.count = corners.length / 3;
  }

  setFrame(frame, column) {
    this.fill(this.place, frame.place);
    this.setColumn(frame, column);
    this.count = frame.count;
  }

  setColumn(frame, column) {
    this.fill(this.level, frame.columns[column]);
  }

  setTable(bytes) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, bytes.length / 1024, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }

  // Draws the first `part` of the particles, and boxes. Sizes are those of the canvas in pixels.
  draw(view, { paper, size, cut, showTree, showDomain, part }) {
    const { gl } = this;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...paper.map((x) => x / 255), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    // What fewer particles leave open, larger ones close.
    this.drawParticles(view, size * part ** (-1 / meta.dimension), cut, Math.ceil(this.count * part), false);
    if (showTree) this.drawBoxes(view, this.tree, cut);
    if (showDomain) this.drawBoxes(view, this.domain, NO_CUT);
  }

  // Returns when all is drawn.
  wait() {
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  drawParticles(view, size, cut, count, picking) {
    const { gl } = this;
    const { program, uniforms } = this.particles;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.matrix, false, view.matrix);
    gl.uniform1f(uniforms.resolution, meta.resolution);
    gl.uniform1f(uniforms.half_width, meta.half_width * size * (meta.dimension === 3 ? 1.2 : 1.1));
    gl.uniform1f(uniforms.doubling, 1 / meta.steps_per_doubling);
    gl.uniform1f(uniforms.pixels, view.pixels);
    gl.uniform4fv(uniforms.cut, cut);
    gl.uniform1i(uniforms.picking, picking);
    gl.uniform1i(uniforms.balls, meta.dimension === 3);
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    gl.bindVertexArray(this.ofParticles);
    gl.drawArrays(gl.POINTS, 0, count);
  }

  drawBoxes(view, boxes, cut) {
    const { gl } = this;
    if (meta.dimension === 2) gl.disable(gl.DEPTH_TEST); // lines lie in the plane of the particles
    gl.useProgram(this.lines.program);
    gl.uniformMatrix4fv(this.lines.uniforms.matrix, false, view.matrix);
    gl.uniform4fv(this.lines.uniforms.cut, cut);
    gl.bindVertexArray(boxes.array);
    gl.drawArraysInstanced(gl.LINES, 0, meta.dimension === 3 ? 24 : 8, boxes.count);
  }

  // The particle drawn at a pixel, or nothing.
  pick(view, { size, cut }, x, y) {
    const { gl } = this;
    const [width, height] = [this.canvas.width, this.canvas.height];
    const target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    const parts = [[gl.COLOR_ATTACHMENT0, gl.RGBA8], [gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24]].map(([place, format]) => {
      const part = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, part);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, part);
      return part;
    });
    gl.viewport(0, 0, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawParticles(view, size, cut, this.count, true);
    const pixel = new Uint8Array(4);
    gl.readPixels(Math.floor(x), height - 1 - Math.floor(y), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    parts.forEach((part) => gl.deleteRenderbuffer(part));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    const id = (pixel[0] | (pixel[1] << 8) | (pixel[2] << 16) | (pixel[3] << 24)) >>> 0;
    return id < this.count ? id : undefined;
  }
}

// Both ends of each edge of the unit cube, those of the square z = 0 first.
function edgesOfBox() {
  const ends = [];
  const edge = (axis, others) => {
    for (const end of [0, 1]) ends.push(...[0, 1, 2].map((a) => (a === axis ? end : (others[a] ?? 0))));
  };
  for (const z of [0, 1]) {
    for (const side of [0, 1]) {
      edge(0, { 1: side, 2: z });
      edge(1, { 0: side, 2: z });
    }
  }
  for (const x of [0, 1]) for (const y of [0, 1]) edge(2, { 0: x, 1: y });
  return new Float32Array(ends);
}
