// Reflection of the point under the cursor, over all view directions, and its strongest orders.

const SIDE = 144; // pixels

class BrdfMap {
  constructor(viewer, canvas, words) {
    Object.assign(this, { viewer, canvas, words });
    canvas.width = canvas.height = SIDE;
    this.at = null; // position on the viewer's canvas, CSS pixels
  }

  // Create framebuffers in the current context.
  prepare() {
    const { gl } = this.viewer.drawing;
    if (this.gl === gl) return;
    this.gl = gl;
    this.picked = new Target(gl, 1, 1, { depth: true, textures: 2 }).frame;
    this.drawn = new Target(gl, SIDE, SIDE, { format: gl.RGBA8 }).frame;
  }

  // Directions of eye and light at a pixel, in the patch's axes, and the surface; null without one.
  pick(x, y) {
    const { viewer, gl } = this;
    const { drawing, canvas } = viewer;
    const view = viewer.viewed();
    // the picture consists of this pixel alone
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    const row = (n, scale, middle) => view.matrix[n].map((value, i) => scale * (value - middle * view.matrix[3][i]));
    const matrix = [row(0, w, (2 * (x + 0.5)) / w - 1), row(1, h, 1 - (2 * (y + 0.5)) / h), view.matrix[2], view.matrix[3]];
    const light = viewer.lights.few.lights[0] ?? viewer.lights.sample(0);
    Object.assign(view.uniforms, { view_projection: columnMajor(matrix), ...lightUniforms([light]) });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picked);
    gl.viewport(0, 0, 1, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    drawing.drawSurfaces({ ...view, lit: viewer.lit.one }, "picked");
    const read = (n) => {
      const found = new Float32Array(4);
      gl.readBuffer(gl.COLOR_ATTACHMENT0 + n);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, found);
      return found;
    };
    const wi = read(0), wo = read(1);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    return wi[3] ? { wi: [...wi.slice(0, 3)], wo: [...wo.slice(0, 3)], stretch: wo[3], surface: drawing.surfaces[wi[3] - 1], light } : null;
  }

  update() {
    if (!this.at || this.viewer.lost) return;
    this.prepare();
    this.found = this.pick(...this.at);
    const diffracts = this.found && this.found.surface.height_scale !== null;
    this.canvas.hidden = !diffracts;
    if (!diffracts) {
      this.words.textContent = "Point at a surface that diffracts: the map shows where its light goes.";
      return;
    }
    this.draw(this.found);
    this.words.textContent = this.orders(this.found);
  }

  draw({ wi, wo, stretch, surface, light }) {
    const { viewer, gl } = this;
    const { drawing } = viewer;
    const view = viewer.viewed();
    if (viewer.drawn === "exact") drawing.setResponses([light]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.drawn);
    const program = drawing.dressed(surface, { ...view, lit: viewer.lit.one }, "map");
    const white = { ...light, place: [0, 0, 1, 0], colour: [1, 1, 1] };
    program.set({
      ...view.uniforms, ...lightUniforms([white], viewer.colour()), wavenumbers: viewer.header.light.wavenumbers,
      height_scale: surface.height_scale * viewer.heights, light_direction: wo, side: SIDE, stretch,
      exposure: 4 * viewer.exposure / (viewer.drawn === "exact" && viewer.wavelength === null ? Math.max(dot(light.colour, LUMINANCE), 1e-6) : 1),
    });
    drawing.full(this.drawn, SIDE, SIDE);
    const pixels = new Uint8ClampedArray(4 * SIDE * SIDE), picture = new ImageData(SIDE, SIDE);
    gl.readPixels(0, 0, SIDE, SIDE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    for (let y = 0; y < SIDE; ++y) picture.data.set(pixels.subarray(4 * SIDE * y, 4 * SIDE * (y + 1)), 4 * SIDE * (SIDE - 1 - y));
    const flat = this.canvas.getContext("2d");
    flat.putImageData(picture, 0, 0);
    const mark = (direction, radius, colour) => {
      flat.beginPath();
      flat.arc((0.5 + 0.5 * direction[0]) * SIDE, (0.5 - 0.5 * direction[1]) * SIDE, radius, 0, 2 * Math.PI);
      flat.strokeStyle = colour;
      flat.stroke();
    };
    mark([0, 0], SIDE / 2 - 0.5, "#ffffff40");
    mark(wi, 4, "#ffffff"); // eye
    if (wo[2] > 0) mark(times(wo, -1), 2, "#8ab8ff"); // mirror direction
  }

  // The strongest orders, and the wavelength of each that is diffracted towards the eye.
  orders({ wi, wo, stretch, surface }) {
    if (wo[2] <= 0) return "The light is behind the surface.";
    const list = this.viewer.header.orders[surface.table];
    if (!list.length) return "White ring: eye. Blue: mirror direction.";
    const [u, v] = plus(wi, wo);
    const lines = list.slice(0, 3).map(([a, b]) => {
      const x = a / stretch, y = b / stretch;
      const length = Math.hypot(x, y), angle = ((Math.atan2(y, x) * 180) / Math.PI + 180) % 180;
      const along = Math.abs(u * x + v * y) / length, nm = (2e3 * Math.PI * along) / length;
      const off = (Math.asin(clamp(Math.abs(u * y - v * x) / length, 0, 1)) * 180) / Math.PI;
      const seen = nm >= 380 && nm <= 780 ? `${nm.toFixed(0)} nm${off < 1 ? "" : `, ${off.toFixed(0)}° off`}` : "not visible";
      return `${((2 * Math.PI) / length).toFixed(2)} µm at ${angle.toFixed(0)}°: ${seen}`;
    });
    return `Strongest periods, and the wavelength towards the eye (ring):\n${lines.join("\n")}`;
  }
}
