// Schedule of drawing. While something moves: few lights, few pixels, few triangles. Afterwards one
// picture of all pixels, and then one light or sample after another, until the picture is smooth.

const BUSY = 100;   // longest step before the page handles events again, ms
const STEPS = 16;   // largest number of steps per sample: each draws all triangles
const FLUENT = 35;  // desired time of a picture while something moves, ms
const SMALLEST = 0.1; // smallest size of a moving picture, relative to the window
const POOR = 0.3;   // relative size below which the number of triangles is reduced
const STILL = 200;  // ms after the last change until the picture counts as still
const SMOOTH = 8;   // number of lights before their mean is shown
const LIGHT = { few: (n, sky) => `#define LIGHTS_LIT ${n}\n${sky ? "#define SKY\n" : ""}`, one: "#define LIGHTS_LIT 1\n" };
// uniforms of a light without shadows
const UNSHADOWED = { light_axis: [0, 0, 0], light_cone: [0, 0], shadow_matrix: new Float32Array(16), shadow_planes: new Float32Array(16), shadow_bias: 0, shadow_steepest: 0 };

// Light of samples that look up the surroundings, and the numbers of each, like glsl/renderer.py.
const WHITE = { place: [0, 0, 1, 0], colour: [1, 1, 1], axis: DARK, cone: [0, 0], spectrum: -1, density: 0 };
const drawnNumbers = (n) => [0.5 + Math.sqrt(1.25), Math.sqrt(19)].map((step) => (0.5 + (n + 1) * step) % 1);

// The scene as it is: the state that the panel changes.
const PLAIN = {
  wavelength: null, // of monochromatic light, nm
  coherence: 1,     // factor on the coherence width
  material: null,   // number in the header's materials
  shadows: true,
  exposure: 1,
  heights: 1,
  turn: 0,          // degrees by which patches are turned
  pigment: null,    // colour (#rrggbb) in place of the pigments beneath
};

class Viewer {
  constructor(canvas, drawing, header) {
    Object.assign(this, { canvas, drawing, header });
    this.camera = new Camera(header.camera, header.subject, header.box);
    this.lights = new Lights(header, this.camera);
    this.method = header.methods[0];
    Object.assign(this, PLAIN);
    this.free = 1;        // share of the width beside the panel
    this.lift = 0;        // share of the height that the panel covers as a sheet below
    this.most = undefined; // number of samples instead of the default
    this.count = 0;       // number of samples in the sums
    this.steps = 8;       // steps per sample, from the bottom up
    this.share = 0.25;    // relative size of moving pictures
    this.detail = 1;      // level of triangles in moving pictures: 0 is all
    this.finest = 0;      // finest level that is fast enough
    this.changed = 0;
    this.dirty = true;
    this.lost = true;     // whether nothing can be drawn: before all is loaded, and without a context
    this.report = () => {};
  }

  get enough() {
    return this.most ?? (this.shadows && this.lights.count > 1 ? 256 : 64);
  }

  get moving() {
    return performance.now() - this.changed < STILL;
  }

  // Method that draws: `exact` for monochromatic light and other coherence widths.
  get drawn() {
    return this.wavelength === null && this.coherence === 1 ? this.method : "exact";
  }

  // Whether environment and emitters are drawn: all light is the scene's, and none has been moved.
  get around() {
    return this.header.around && this.wavelength === null && this.lights.whole;
  }

  // Whether lobes look up the surroundings: all, or where `around` is false other surfaces alone.
  get looksUp() {
    return this.shadows && (this.around || (this.header.around?.bounces ?? false));
  }

  // Definitions of the light for programs: a few lights at once, or one.
  get lit() {
    const { lights, sky } = this.lights.few;
    const one = this.wavelength === null ? "" : "#define MONOCHROME\n";
    const few = LIGHT.few(lights.length, sky.some((x) => x)) + one, glance = `${few}#define GLANCE\n`;
    return this.looksUp
      ? { glance, few, one: `${LIGHT.one + one}#define WEIGHTED\n`, lookup: `${LIGHT.one + one}#define LOOKED_UP\n` }
      : { glance, few, one: LIGHT.one + one };
  }

  // Restart the picture after a change.
  touch() {
    this.dirty = true;
    this.sample = undefined;
    this.changed = performance.now();
    this.wake();
  }

  wake() {
    if (this.frame === undefined) this.frame = requestAnimationFrame(() => this.step());
  }

  fit() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (width === this.drawing.width && height === this.drawing.height) return;
    this.drawing.resize(width, height);
    this.shown = undefined;
    this.touch();
  }

  begin(moving) {
    const { drawing, lights } = this;
    if (this.dirty) {
      this.count = 0;
      this.whole = this.half = false;
    }
    this.dirty = false;
    const preview = moving || (this.shadows && !this.whole);
    const one = !preview && this.shadows;
    const { around, looksUp } = this, lookup = one && this.half;
    const { lights: few, sky } = lights.few;
    const chosen = lookup ? [WHITE] : one ? [lights.sample(this.count)] : few;
    // few different sizes, since each needs another canvas
    const share = moving ? 2 ** (Math.floor(2 * Math.log2(this.share)) / 2) : 1;
    const detail = moving ? this.detail : 0;
    const width = Math.max(1, Math.round(drawing.width * share));
    const height = Math.max(1, Math.round(drawing.height * share));
    // shapes that only emit light shade only directional lights
    const far = around && chosen[0]?.place[3] === 0;
    const casters = drawing.surfaces.filter(({ emits, lamp }) => (far || !emits) && (around || !lamp));
    const shadow = this.shadows && chosen.length && !lookup ? drawing.shadows[moving ? "coarse" : "fine"].draw(chosen[0], casters, detail, one ? this.count : 0) : UNSHADOWED;
    // draw moving pictures by the faster method
    const method = moving && this.drawn === this.method && drawing.tables.fast ? "fast" : this.drawn;
    if (method === "exact") drawing.setResponses(chosen);
    const [x, y] = even(this.count); // in the pixel
    const view = this.viewed([(2 * x - 1) / width, (2 * y - 1) / height]);
    const colour = this.colour();
    Object.assign(view.uniforms, { sky: colour ? monochrome(sky, colour) : sky, ...lightUniforms(chosen, colour), ...shadow });
    const sun = around && lights.own.find(({ name }) => name.startsWith("sun of "));
    if (sun) view.uniforms.sun = [...unit(sun.place), this.header.around.parts.uniforms.sun[3]]; // may have been moved
    if (lookup) view.uniforms.sequence = drawnNumbers(this.count);
    const shown = [lights.kind === "scene" ? 1 : 0, lights.whole ? 1 : 0];
    // only light that lobes look up shares them with lights drawn
    const density = (looksUp && chosen[0]?.density) || 0;
    if (!lookup) view.uniforms.light_density = chosen[0]?.place[3] && !shown[1] ? 0 : density;
    Object.assign(view.uniforms, { surroundings_lit: shown, dome: [...this.camera.up, lights.dome] });
    const lit = this.lit[lookup ? "lookup" : one ? "one" : moving ? "glance" : "few"], bright = lookup || !(one && looksUp);
    this.sample = { ...view, method, width, height, preview, moving, detail, lit, around, looksUp: looksUp && one, lookup, bright, row: 0, time: 0 };
  }

  // Matrix and uniforms that do not depend on the light.
  viewed(jitter = [0, 0]) {
    const matrix = this.camera.projection(this.drawing.width / this.drawing.height, this.free, jitter, this.lift);
    const uniforms = { view_projection: columnMajor(matrix), eye: this.camera.eye };
    if (this.wavelength !== null) uniforms.wavenumber = (2e3 * Math.PI) / this.wavelength;
    const turn = (this.turn * Math.PI) / 180, { material, coherence, pigment } = this;
    const base = material !== null && this.header.materials[material].absorbs ? DARK : pigment && colourOf(pigment);
    Object.assign(uniforms, { patch_turn: [Math.cos(turn), Math.sin(turn)], live_pigment: base ? [...base, 1] : [0, 0, 0, 0] });
    return { matrix, up: this.camera.up, method: this.drawn, heights: this.heights, material, coherence, uniforms };
  }

  // Linear sRGB of monochromatic light, or null for all wavelengths.
  colour() {
    if (this.wavelength === null) return null;
    const { first, step, colours } = this.header.light.monochrome;
    const place = clamp((this.wavelength - first) / step, 0, colours.length - 1.001), low = Math.floor(place);
    return plus(times(colours[low], 1 - (place - low)), colours[low + 1], place - low);
  }

  step() {
    this.frame = undefined;
    if (this.lost) return;
    this.fit();
    const { moving } = this;
    if (!moving) this.improve();
    else if (this.dirty || !this.latest?.moving) this.glance();
    const still = !moving && !this.dirty && this.latest && !this.latest.moving;
    if (!still || this.count < this.enough) this.wake();
  }

  // Draw stand-ins for the meshes: the driver prepares its programs while these are decoded.
  rehearse() {
    this.begin(true);
    this.drawing.drawRows(this.sample, 0, this.sample.height);
    this.drawing.gl.flush();
    this.sample = undefined;
    this.dirty = true;
  }

  // Draw one picture while something moves, small enough to be fast.
  glance() {
    const start = performance.now();
    this.begin(true);
    const { sample } = this;
    this.drawing.drawRows(sample, 0, sample.height);
    this.keep(sample);
    this.present();
    this.drawing.finish(null);
    sample.time = performance.now() - start;
    this.adapt(sample.time);
    this.report(sample, 0);
  }

  // Draw samples, or rows of one, while nothing moves, until the page should handle events.
  improve() {
    const start = performance.now();
    let shown, done;
    while (this.dirty || this.sample || this.latest?.moving || this.count < this.enough) {
      if (!this.sample) this.begin(false);
      const { sample } = this;
      this.draw(sample, start);
      if (sample.row < sample.height) break;
      const half = sample.looksUp && !sample.lookup; // the second half looks up the surroundings
      const few = this.shadows && this.count + 1 < Math.min(SMOOTH, this.enough);
      const early = !sample.preview && (half || few) && this.shown;
      this.keep(sample, early);
      this.half = half;
      if (sample.preview) this.whole = true;
      else if (!half) this.count += 1;
      if (!early) shown = true;
      done = sample;
      if (performance.now() - start > BUSY / 2) break; // else draw several at once
    }
    if (shown) this.present();
    if (done) this.report(done, this.count);
  }

  // Add a finished sample; early: too few samples to show.
  keep(sample, early = false) {
    this.drawing.keep(sample, this.count === 0 && !sample.lookup);
    if (!early) this.shown = sample;
    this.latest = sample;
    this.sample = undefined;
  }

  // Adapt the size of the next moving picture to the desired time; reduce its triangles permanently
  // if it would get too small.
  adapt(time) {
    const factor = clamp(Math.sqrt(FLUENT / Math.max(time, 1)), 0.5, 1.3);
    this.share = clamp(this.share * factor, SMALLEST, 1);
    if (this.share < POOR && this.detail < FEWER.length) {
      this.detail += 1;
      this.finest = this.detail;
    } else if (this.share === 1 && time < FLUENT / 4 && this.detail > this.finest) this.detail -= 1;
  }

  // Draw rows of a sample, until it is complete or the page should handle events.
  draw(sample, start) {
    let last = performance.now();
    while (sample.row < sample.height && last - start < BUSY / 2) {
      const top = Math.min(sample.row + Math.ceil(sample.height / this.steps), sample.height);
      this.drawing.drawRows(sample, sample.row, top);
      this.drawing.finish();
      const now = performance.now();
      // as many rows at once as can be drawn without a noticeable delay
      if (now - last > BUSY) this.steps = Math.min(STEPS, this.steps * 2);
      else if (now - last < BUSY / 3) this.steps = Math.max(1, this.steps / 2);
      sample.time += now - last;
      sample.row = top;
      last = now;
    }
  }

  // Show the samples so far, with the current exposure.
  present() {
    if (this.shown) this.drawing.show(this.shown, this.count, this.exposure, this.half);
  }

  // Change method, wavelength, coherence, material or kind of light, after compiling the programs.
  async change(change, progress) {
    const set = ({ kind, ...others }) => {
      Object.assign(this, others);
      this.lights.kind = kind;
    };
    const { method, wavelength, coherence, material, lights: { kind } } = this;
    const before = { method, wavelength, coherence, material, kind }, after = { ...before, ...change };
    set(after);
    const { drawn, lit } = this;
    set(before); // meanwhile, draw with the programs that exist
    await this.drawing.prepare(drawn, lit, progress, after.material);
    set(after);
    this.touch();
  }
}

// Smooth sky in one colour, with the same luminance.
const monochrome = (sky, colour) =>
  [0, 3, 6, 9].flatMap((n) => times(colour, dot(sky.slice(n, n + 3), LUMINANCE)));
