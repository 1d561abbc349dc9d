// Programs, textures and pictures in the making.

const ADD = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D sums;
uniform sampler2D sample_;
uniform bool first;
out vec4 fragment;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  fragment = texelFetch(sample_, at, 0) + (first ? vec4(0.0) : texelFetch(sums, at, 0));
}`;

function compiled(gl, kind, source) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
    throw new Error(`The graphics driver refuses a shader: ${gl.getShaderInfoLog(shader)}`);
  return shader;
}

class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.program = gl.createProgram();
    gl.attachShader(this.program, compiled(gl, gl.VERTEX_SHADER, vertex));
    gl.attachShader(this.program, compiled(gl, gl.FRAGMENT_SHADER, fragment));
    Object.keys(ATTRIBUTES).forEach((name, n) => gl.bindAttribLocation(this.program, n, name));
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(`The graphics driver refuses a program: ${gl.getProgramInfoLog(this.program)}`);
    this.uniforms = {};
    const count = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS);
    for (let n = 0; n < count; ++n) {
      const { name, type } = gl.getActiveUniform(this.program, n);
      const location = gl.getUniformLocation(this.program, name);
      this.uniforms[name.replace("[0]", "")] = { location, type };
    }
  }

  use() {
    this.gl.useProgram(this.program);
    this.unit = 0;
  }

  // Sets those that the program reads: compilers remove the others.
  set(values) {
    const { gl } = this;
    for (const [name, value] of Object.entries(values)) {
      if (!(name in this.uniforms)) continue;
      const { location, type } = this.uniforms[name];
      if (type === gl.FLOAT) gl.uniform1f(location, value);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(location, value);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(location, value);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(location, value);
      else if (type === gl.INT_VEC2) gl.uniform2iv(location, value);
      else if (type === gl.FLOAT_MAT3) gl.uniformMatrix3fv(location, false, value);
      else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(location, false, value);
      else gl.uniform1i(location, value);
    }
  }

  texture(name, texture) {
    if (!(name in this.uniforms)) return;
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + this.unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(this.uniforms[name].location, this.unit++);
  }
}

async function uploadTexture(gl, data, entry) {
  const { width, height, channels } = entry;
  const texture = gl.createTexture();
  const content = entry.kind === "picture" ? await data.picture(entry.section) : await data.array(entry.section);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  if (entry.kind === "picture") {
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, content);
    content.close();
  } else {
    const n = [1, 2, 4].indexOf(channels);
    const { internal, type } = {
      half: { internal: [gl.R16F, gl.RG16F, gl.RGBA16F], type: gl.HALF_FLOAT },
      single: { internal: [gl.R32F, gl.RG32F, gl.RGBA32F], type: gl.FLOAT },
      words: { internal: [gl.R32UI, gl.RG32UI, gl.RGBA32UI], type: gl.UNSIGNED_INT },
    }[entry.kind];
    const words = [gl.RED_INTEGER, gl.RG_INTEGER, gl.RGBA_INTEGER];
    const format = (entry.kind === "words" ? words : [gl.RED, gl.RG, gl.RGBA])[n];
    const numbers = content.subarray(0, width * height * channels);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal[n], width, height, 0, format, type, numbers);
  }
  const filter = entry.smooth ? gl.LINEAR : gl.NEAREST;
  const wrap = entry.smooth ? gl.REPEAT : gl.CLAMP_TO_EDGE;
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
  return texture;
}

// Uniforms and textures that belong together.
class Part {
  static async load(gl, data, described) {
    const part = new Part();
    part.uniforms = described.uniforms;
    part.textures = [];
    for (const entry of described.textures) part.textures.push([entry.name, await uploadTexture(gl, data, entry)]);
    return part;
  }

  use(program) {
    program.set(this.uniforms);
    for (const [name, texture] of this.textures) program.texture(name, texture);
  }
}

// A picture of floats, with depth if it is drawn into.
class Target {
  constructor(gl, width, height, depth) {
    this.gl = gl;
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    if (!depth) return;
    this.depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT32F, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.depth);
  }

  release() {
    this.gl.deleteTexture(this.texture);
    this.gl.deleteFramebuffer(this.frame);
    if (this.depth) this.gl.deleteRenderbuffer(this.depth);
  }
}

class Drawing {
  static async load(gl, header, data, progress) {
    const drawing = new Drawing();
    Object.assign(drawing, { gl, header, data, programs: {}, methods: {} });
    drawing.surfaces = [];
    for (const surface of header.surfaces) {
      await progress(`Unpacking ${surface.name}`);
      drawing.surfaces.push({
        ...surface, mesh: await uploadMesh(gl, data, surface.mesh), part: await Part.load(gl, data, surface.parts),
      });
    }
    drawing.responses = await Part.load(gl, data, header.responses);
    const whole = header.shown.vertex;
    drawing.add = new Program(gl, whole, ADD);
    drawing.shown = new Program(gl, whole, header.shown.fragment);
    drawing.empty = gl.createVertexArray();
    return drawing;
  }

  // A method's tables and programs, when it is first wanted.
  async prepare(method, progress) {
    if (this.methods[method]) return;
    await progress(`Unpacking the tables of ${method}`);
    const tables = [];
    for (const table of this.header.tables[method]) tables.push(await Part.load(this.gl, this.data, table));
    await progress(`Compiling ${method}`);
    for (const surface of this.surfaces) {
      const n = surface.programs[method];
      this.programs[n] ??= new Program(this.gl, this.header.vertex, this.header.programs[n]);
    }
    this.methods[method] = tables;
  }

  resize(width, height) {
    for (const target of [this.sample, ...(this.sums ?? [])]) target?.release();
    Object.assign(this, { width, height });
    this.sample = new Target(this.gl, width, height, true);
    this.sums = [new Target(this.gl, width, height), new Target(this.gl, width, height)];
  }

  // One sample of every pixel in rows [bottom, top) of a picture, linear.
  drawRows(view, bottom, top) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sample.frame);
    gl.viewport(0, 0, view.width, view.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, bottom, view.width, top - bottom);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const octaves = Math.log2(view.heights);
    const [first, last] = this.header.octaves;
    const page = ((octaves - first) / (last - first)) * (this.header.energy_pages - 1);
    for (const surface of this.surfaces) {
      const program = this.programs[surface.programs[view.method]];
      program.use();
      surface.part.use(program);
      this.methods[view.method][surface.table].use(program);
      this.responses.use(program);
      program.set({
        ...view.uniforms,
        height_scale: (surface.height_scale ?? 1) * view.heights,
        energy_page: page,
      });
      surface.mesh.draw();
    }
    gl.disable(gl.SCISSOR_TEST);
  }

  full(frame, width, height) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }

  // Adds the sample to the sums.
  keep(view, first) {
    this.sums.reverse();
    this.add.use();
    this.add.set({ first });
    this.add.texture("sums", this.sums[1].texture);
    this.add.texture("sample_", this.sample.texture);
    this.full(this.sums[0].frame, view.width, view.height);
  }

  // On the screen: the mean of the samples so far.
  show(view, count, exposure) {
    this.shown.use();
    this.shown.set({
      sample_count: count, exposure, pixel: [view.width / this.width, view.height / this.height],
      background: this.header.background.map((x) => Math.max(x * exposure, 0)),
    });
    this.shown.texture("samples", this.sums[0].texture);
    this.full(null, this.width, this.height);
  }

  // Waits until all is drawn.
  finish() {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sample.frame);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, new Float32Array(4));
  }

  // Mean of the samples, linear sRGB and coverage, from the bottom row up.
  read(count) {
    const { gl, width, height } = this;
    const numbers = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sums[0].frame);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, numbers);
    return numbers.map((x) => x / count);
  }
}
