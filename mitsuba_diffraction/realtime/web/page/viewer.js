// What is drawn when: at once while something moves, then sample after sample until it is smooth.

const SAMPLES = 64;
const BUSY = 200;  // ms that a step may take before the page answers again
const STEPS = 16;  // at most, of one sample: each draws all triangles anew
const FLUENT = 30; // ms that a picture may take while something moves
const STILL = 200; // ms after the last change

// Evenly spread places in a pixel, from its middle on (the R₂ sequence of M. Roberts).
const spread = (n, share) => ((0.5 + n * share) % 1) * 2 - 1;

class Viewer {
  constructor(canvas, drawing, header) {
    Object.assign(this, { canvas, drawing, header });
    this.camera = new Camera(header.camera, header.subject, header.box);
    this.sun = new Sun(header.lights, this.camera);
    this.method = header.methods[0];
    this.exposure = 1;
    this.heights = 1;
    this.free = 1;        // share of the width that the panel leaves
    this.most = SAMPLES;
    this.count = 0;       // samples in the sums
    this.steps = 8;       // of one sample, from the bottom up
    this.fullTime = {};   // ms of a whole sample, by method
    this.changed = 0;
    this.dirty = true;
    this.waiting = [];
    this.report = () => {};
  }

  // Something that is drawn is another now.
  touch() {
    this.dirty = true;
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
    this.canvas.width = width;
    this.canvas.height = height;
    this.drawing.resize(width, height);
    this.sample = this.shownSample = undefined;
    this.count = 0;
    this.touch();
  }

  begin() {
    const moving = performance.now() - this.changed < STILL;
    const time = this.fullTime[this.method] ?? 0;
    const share = moving ? clamp(Math.sqrt(FLUENT / Math.max(time, 1)), 0.2, 1) : 1;
    if (this.dirty || share !== this.share) this.count = 0;
    this.dirty = false;
    this.share = share;
    const width = Math.max(1, Math.round(this.drawing.width * share));
    const height = Math.max(1, Math.round(this.drawing.height * share));
    const jitter = [spread(this.count, 0.7548776662) / width, spread(this.count, 0.5698402910) / height];
    const matrix = this.camera.projection(this.drawing.width / this.drawing.height, this.free, jitter);
    const uniforms = {
      view_projection: columnMajor(matrix),
      eye: this.camera.eye,
      view_axis: [0, 0, 0],
      sky: this.header.sky,
      exposure: 1,
      ...this.sun.uniforms(),
    };
    this.sample = { width, height, method: this.method, heights: this.heights, uniforms, row: 0, time: 0 };
  }

  step() {
    this.frame = undefined;
    this.fit();
    const start = performance.now();
    let shown;
    do {
      if (!this.sample) this.begin();
      const { sample } = this;
      this.draw(sample, start);
      if (sample.row < sample.height) break;
      this.drawing.keep(sample, this.count === 0);
      this.count += 1;
      if (this.share === 1) this.fullTime[sample.method] = sample.time;
      this.shownSample = shown = sample;
      this.sample = undefined;
      // several at once where they are quick, but one while something moves
    } while (this.share === 1 && this.count < this.most && performance.now() - start < BUSY / 2);
    if (shown) {
      this.present();
      this.report(shown.time, this.count, shown);
    }
    const still = !this.dirty && !this.sample && this.share === 1;
    if (!still || this.count < this.most) this.wake();
    this.waiting = this.waiting.filter(({ count, resolve }) => {
      const there = still && this.count >= count;
      if (there) resolve();
      return !there;
    });
  }

  // Rows of a sample, until it has all or the page should answer again.
  draw(sample, start) {
    let last = performance.now();
    while (sample.row < sample.height && last - start < BUSY / 2) {
      const top = Math.min(sample.row + Math.ceil(sample.height / this.steps), sample.height);
      this.drawing.drawRows(sample, sample.row, top);
      this.drawing.finish();
      const now = performance.now();
      // as many rows at once as can be drawn while nobody notices
      if (now - last > BUSY) this.steps = Math.min(STEPS, this.steps * 2);
      else if (now - last < BUSY / 3) this.steps = Math.max(1, this.steps / 2);
      sample.time += now - last;
      sample.row = top;
      last = now;
    }
  }

  // The samples so far, at another exposure perhaps.
  present() {
    if (this.shownSample) this.drawing.show(this.shownSample, this.count, this.exposure);
  }

  // Resolves when a still picture has so many samples, fails after some ms.
  settled(count = this.most, patience = 120e3) {
    this.wake();
    return new Promise((resolve, reject) => {
      this.waiting.push({ count, resolve });
      setTimeout(() => reject(new Error(`no ${count} samples in ${patience / 1e3} s`)), patience);
    });
  }

  async choose(method, progress) {
    await this.drawing.prepare(method, progress);
    this.method = method;
    this.touch();
  }
}
