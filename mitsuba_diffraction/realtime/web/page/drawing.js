// WebGL programs, textures and framebuffers, and drawing with them.

// Setters of uniforms by their types; others are numbers of textures, integers and conditions.
const SETTERS = {
  FLOAT: "1f", FLOAT_VEC2: "2fv", FLOAT_VEC3: "3fv", FLOAT_VEC4: "4fv", INT_VEC2: "2iv", INT_VEC3: "3iv",
  FLOAT_MAT3: "Matrix3fv", FLOAT_MAT4: "Matrix4fv",
};

// Program that the driver compiles beside the page's scripts, which only `finish` waits for.
class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.program = gl.createProgram();
    this.shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, source]) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
      return shader;
    });
    gl.linkProgram(this.program);
  }

  finish() {
    if (this.uniforms) return;
    const { gl } = this;
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const words = this.shaders.map((shader) => gl.getShaderInfoLog(shader)).join("") || gl.getProgramInfoLog(this.program);
      throw new Error(`The graphics driver refuses a shader: ${words}`);
    }
    this.uniforms = {};
    const count = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS);
    for (let n = 0; n < count; ++n) {
      const { name, type } = gl.getActiveUniform(this.program, n);
      const location = gl.getUniformLocation(this.program, name);
      const kind = Object.keys(SETTERS).find((each) => gl[each] === type);
      this.uniforms[name.replace("[0]", "")] = { location, setter: `uniform${SETTERS[kind] ?? "1i"}` };
    }
  }

  use() {
    this.finish();
    this.gl.useProgram(this.program);
    this.unit = 0;
  }

  // Set the uniforms that the program reads: compilers remove the others.
  set(values) {
    const { gl } = this;
    for (const [name, value] of Object.entries(values)) {
      if (!(name in this.uniforms)) continue;
      const { location, setter } = this.uniforms[name];
      if (setter.includes("Matrix")) gl[setter](location, false, value);
      else gl[setter](location, value);
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

// Texture without content; its texels are not interpolated.
function texels(gl, format, width, height) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  return texture;
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
      bytes: { internal: [gl.R8, gl.RG8, gl.RGBA8], type: gl.UNSIGNED_BYTE },
      half: { internal: [gl.R16F, gl.RG16F, gl.RGBA16F], type: gl.HALF_FLOAT },
      single: { internal: [gl.R32F, gl.RG32F, gl.RGBA32F], type: gl.FLOAT },
    }[entry.kind];
    const format = [gl.RED, gl.RG, gl.RGBA][n];
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal[n], width, height, 0, format, type, content);
  }
  const [filter, wrap] = entry.smooth ? [gl.LINEAR, gl.REPEAT] : [gl.NEAREST, gl.CLAMP_TO_EDGE];
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, filter);
  for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, axis, wrap);
  return texture;
}

// Uniforms and textures that belong together.
class Part {
  static async load(gl, data, described) {
    const part = new Part();
    part.uniforms = described.uniforms;
    part.textures = await Promise.all(described.textures.map(async (entry) => [entry.name, await uploadTexture(gl, data, entry)]));
    return part;
  }

  use(program) {
    program.set(this.uniforms);
    for (const [name, texture] of this.textures) program.texture(name, texture);
  }
}

// Framebuffer, of floats by default, with depth if surfaces are drawn into it.
class Target {
  constructor(gl, width, height, { depth = false, format = gl.RGBA32F, textures = 1 } = {}) {
    this.gl = gl;
    this.textures = Array.from({ length: textures }, () => texels(gl, format, width, height));
    this.texture = this.textures[0];
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    const places = this.textures.map((_, n) => gl.COLOR_ATTACHMENT0 + n);
    this.textures.forEach((texture, n) => gl.framebufferTexture2D(gl.FRAMEBUFFER, places[n], gl.TEXTURE_2D, texture, 0));
    gl.drawBuffers(places);
    if (!depth) return;
    this.depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT32F, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.depth);
  }

  release() {
    for (const texture of this.textures) this.gl.deleteTexture(texture);
    this.gl.deleteFramebuffer(this.frame);
    if (this.depth) this.gl.deleteRenderbuffer(this.depth);
  }
}

// Constants of a table of orders for a coherence width times a factor of at most 1. The window of
// orders other than the mirror's is narrower than that already where the patch is. The taper of a
// scan's windows stays, and the look-up makes up for it.
function narrower({ sigma, order_0_ratio = 1, area_factor, inverse_taper = 0 }, factor) {
  const mirror = factor * sigma * Math.sqrt(order_0_ratio);
  const seen = Math.min((sigma ** -2 + inverse_taper) ** -0.5, mirror);
  const others = (seen ** -2 - inverse_taper) ** -0.5;
  return { sigma: others, order_0_ratio: (mirror / others) ** 2, area_factor: area_factor * (others / sigma) ** 2 };
}

const RESPONSES = 4; // rows, one per light
const PIXEL = { floats: new Float32Array(4), bytes: new Uint8Array(4) };

class Drawing {
  constructor(gl, header, data) {
    Object.assign(this, { gl, header, data, programs: {}, tables: {}, materials: {} });
  }

  // Load all but tables and meshes, while the driver compiles; arguments: those of `compiled`.
  async load(method, lit, material) {
    const { gl, header, data } = this, { light } = header;
    this.sources = JSON.parse(await data.text(header.programs));
    this.compiled(method, lit, material);
    const whole = header.shown.vertex;
    this.add = new Program(gl, whole, header.add);
    this.shown = new Program(gl, whole, header.shown.fragment);
    this.shadows = { fine: new ShadowMap(gl, header, 2048), coarse: new ShadowMap(gl, header, 256) };
    this.surfaces = await Promise.all(header.surfaces.map(async (surface) => ({
      ...surface, mesh: new Mesh(gl, surface.mesh), part: await Part.load(gl, data, surface.parts),
    })));
    this.daylight = await data.array(light.daylight);
    this.spectra = light.spectra === null ? null : await data.array(light.spectra);
    this.responses = texels(gl, gl.RGBA32F, this.daylight.length / 4, RESPONSES);
    this.empty = gl.createVertexArray();
    if (!header.around) return;
    const { parts, lobes, background } = header.around;
    this.around = await Part.load(gl, data, parts);
    this.lobes = await Promise.all(lobes.map((one) => Part.load(gl, data, one)));
    this.background = background && new Program(gl, whole, background);
  }

  async loadMeshes() {
    for (const { mesh } of this.surfaces) await mesh.load(this.data);
    for (const map of Object.values(this.shadows)) map.key = undefined; // those of the stand-ins
  }

  // Programs of all surfaces, one for each of some definitions of the light; material: number of a
  // material that surfaces are given, or null.
  compiled(method, lit, material) {
    return this.header.surfaces.flatMap((surface) => Object.values(lit).map((light) => this.program(surface, method, light, "surface", material)));
  }

  // Load a method's tables and wait for programs.
  async prepare(method, lit, progress, material = null) {
    const loaded = (parts) => Promise.all(parts.map((part) => Part.load(this.gl, this.data, part)));
    if (!this.tables[method]) {
      await progress("Unpacking colours");
      this.tables[method] = await loaded(this.header.tables[method]);
    }
    if (material !== null && !this.materials[material])
      this.materials[material] = await loaded(this.header.materials[material].parts);
    await progress("Preparing");
    for (const program of this.compiled(method, lit, material)) program.finish();
  }

  // Program of a surface, compiled once for each source, definitions of the light and main function.
  program(surface, method, lit, main = "surface", material = null) {
    const { gl, header } = this;
    const { [method]: number } = material === null || !(method in surface.named) ? surface.programs : surface.named;
    const key = `${number} ${lit} ${main}`;
    const fragment = () => this.sources[number].replace("#define LIGHTS_LIT 1\n", lit) + header.mains[main];
    return (this.programs[key] ??= new Program(gl, main === "map" ? header.shown.vertex : header.vertex, fragment()));
  }

  resize(width, height) {
    for (const target of [this.sample, this.held, ...(this.sums ?? [])]) target?.release();
    // made when they are drawn into: the first picture takes but one
    Object.assign(this, { width, height, sample: undefined, held: undefined, sums: undefined });
  }

  // Upload the lights' spectra for the method `exact`.
  setResponses(lights) {
    const { gl, daylight, spectra, header } = this;
    const columns = header.light.columns, channels = header.light.channels, waves = columns / channels;
    const [first, last] = header.light.wavenumbers, n = daylight.length / 4;
    gl.bindTexture(gl.TEXTURE_2D, this.responses);
    lights.slice(0, RESPONSES).forEach((light, row) => {
      const found = new Float32Array(daylight);
      if (light.spectrum < 0) for (let i = 0; i < found.length; ++i) found[i] *= light.colour[Math.min(i % 4, 2)];
      else
        for (let i = 0; i < n; ++i) {
          const nm = (2e3 * Math.PI) / (first + ((last - first) * i) / (n - 1));
          const place = clamp(((nm - 360) / 470) * (waves - 1), 0, waves - 1), low = Math.min(Math.floor(place), waves - 2);
          for (let c = 0; c < 3; ++c) {
            const at = light.spectrum * columns + low * channels + Math.min(c, channels - 1);
            found[4 * i + c] *= spectra[at] + (spectra[at + channels] - spectra[at]) * (place - low);
          }
        }
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, n, 1, gl.RGBA, gl.FLOAT, found);
    });
  }

  // Use a surface's program, constants and textures, as the controls change them; view: from
  // Viewer.viewed, with `lit`.
  dressed(surface, view, main) {
    const { method, material, coherence } = view;
    const program = this.program(surface, method, view.lit, main, material), table = this.tables[method][surface.table];
    program.use();
    surface.part.use(program);
    if (material !== null && method in surface.named) this.materials[material][surface.coat].use(program);
    table.use(program);
    program.texture("responses", this.responses);
    if (coherence !== 1) program.set(narrower(table.uniforms, coherence));
    return program;
  }

  // Draw all surfaces with a main function; view: from Viewer.begin.
  drawSurfaces(view, main) {
    const octaves = Math.log2(view.heights);
    const [first, last] = this.header.octaves;
    const page = ((octaves - first) / (last - first)) * (this.header.energy_pages - 1);
    this.surfaces.forEach((surface, number) => {
      if (surface.lamp && !view.around) return; // lamps belong to the scene's light
      const program = this.dressed(surface, view, main);
      program.texture("shadow_map", this.shadows[view.moving ? "coarse" : "fine"].texture);
      if (view.looksUp) {
        this.around.use(program);
        this.lobes[surface.table]?.use(program);
      }
      program.set({
        ...view.uniforms,
        wavenumbers: this.header.light.wavenumbers,
        height_scale: (surface.height_scale ?? 1) * view.heights,
        energy_page: page,
        surface_number: number,
      });
      surface.mesh.draw(view.detail ?? 0);
    });
  }

  // Draw one sample of every pixel in rows [bottom, top) of a picture, linear.
  drawRows(view, bottom, top) {
    const { gl } = this;
    this.sample ??= new Target(gl, this.width, this.height, { depth: true });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sample.frame);
    gl.viewport(0, 0, view.width, view.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, bottom, view.width, top - bottom);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (view.around && view.bright && this.background) this.drawBackground(view);
    this.drawSurfaces(view, "surface");
    gl.disable(gl.SCISSOR_TEST);
  }

  // Draw the environment.
  drawBackground({ uniforms, matrix, up, width, height }) {
    const { gl, background } = this;
    gl.disable(gl.DEPTH_TEST);
    background.use();
    this.around.use(background);
    background.set({
      ...uniforms, from_clip: columnMajor(inverse(matrix)), picture_size: [width, height],
      horizon: up, // a sky that is dark below is mirrored at the horizon
    });
    this.triangle();
    gl.enable(gl.DEPTH_TEST);
  }

  full(frame, width, height) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    this.triangle();
  }

  // Draw a triangle that covers the picture.
  triangle() {
    const { gl } = this;
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }

  // Add the sample to the sums; a preview is stored beside them.
  keep(view, first) {
    if (view.preview) {
      [this.sample, this.held] = [this.held, this.sample];
      return;
    }
    this.sums ??= [0, 1].map(() => new Target(this.gl, this.width, this.height));
    this.sums.reverse();
    this.add.use();
    this.add.set({ first, covers: view.lookup ? 0 : 1 });
    this.add.texture("sums", this.sums[1].texture);
    this.add.texture("frame", this.sample.texture);
    this.full(this.sums[0].frame, view.width, view.height);
  }

  // Show the mean of the samples so far; half: the last sum has only the first kind of frame. The
  // browser enlarges smaller pictures, several times as fast as software drivers.
  show(view, count, exposure, half) {
    const { width, height } = view, { canvas } = this.gl;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.shown.use();
    this.shown.set({
      sample_count: view.preview ? 1 : count, exposure,
      background: view.around && this.background ? DARK : this.header.background.map((x) => Math.max(x * exposure, 0)),
    });
    this.shown.texture("samples", view.preview ? this.held.texture : this.sums[half ? 1 : 0].texture);
    this.full(null, width, height);
  }

  // Wait until all is drawn; frame: null is the screen.
  finish(frame = this.sample.frame) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, frame ? gl.FLOAT : gl.UNSIGNED_BYTE, frame ? PIXEL.floats : PIXEL.bytes);
  }
}
