// Mouse, fingers, keys and the panel.

const element = (id) => document.getElementById(id);

class Controls {
  constructor(viewer, fail) {
    this.viewer = viewer;
    this.fail = fail;
    this.pointers = new Map();
    this.canvas();
    this.panel();
    this.disc();
    viewer.report = (time, count, sample) => this.report(time, count, sample);
  }

  canvas() {
    const { canvas, camera } = this.viewer;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, event);
      element("hint").classList.add("gone");
    });
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      const before = this.pointers.get(event.pointerId);
      if (!before) return;
      if (this.pointers.size === 2) this.pinch(before, event);
      else this.drag(before, event);
      this.pointers.set(event.pointerId, event);
      this.moved();
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode ? 16 : 1;
      camera.zoom(Math.exp(clamp(event.deltaY * lines, -200, 200) * 1e-3));
      this.moved();
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    window.addEventListener("keydown", (event) => {
      if (event.target instanceof HTMLInputElement || event.ctrlKey || event.metaKey) return;
      if (event.key === "r") this.reset();
      if (event.key === "s") this.save();
      if (event.key === "h") document.body.classList.toggle("bare");
    });
    new ResizeObserver(() => this.arrange()).observe(canvas);
    new ResizeObserver(() => this.arrange()).observe(element("panel"));
  }

  // The picture is beside the panel where there is room.
  arrange() {
    const { viewer } = this;
    const panel = element("panel").offsetWidth + 12, whole = viewer.canvas.clientWidth;
    const beside = panel > 100 && whole > 2 * panel;
    const free = beside ? 1 - panel / whole : 1;
    viewer.fit();
    if (free === viewer.free) return;
    viewer.free = free;
    viewer.touch();
  }

  drag(before, event) {
    const { camera, sun, canvas } = this.viewer;
    const right = event.clientX - before.clientX, down = event.clientY - before.clientY;
    if (event.shiftKey || event.buttons & 2) {
      if (sun.lights.length) sun.move(right / 220, -down / 220);
    } else if (event.ctrlKey || event.metaKey || event.buttons & 4) this.pan(right, down);
    else camera.orbit((3 * right) / canvas.clientHeight, (3 * down) / canvas.clientHeight);
  }

  pan(right, down) {
    const { camera, canvas } = this.viewer;
    const step = (2 * camera.view(canvas.clientWidth / canvas.clientHeight, this.viewer.free)[1] * camera.distance) / canvas.clientHeight;
    camera.pan(right * step, down * step);
  }

  // Two fingers: their middle pans, their distance zooms.
  pinch(before, event) {
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
    const apart = (a) => Math.hypot(a.clientX - other.clientX, a.clientY - other.clientY);
    this.viewer.camera.zoom(apart(before) / Math.max(apart(event), 1));
    this.pan((event.clientX - before.clientX) / 2, (event.clientY - before.clientY) / 2);
  }

  moved() {
    this.viewer.touch();
    this.drawDisc();
  }

  panel() {
    const { viewer } = this;
    const { header } = viewer;
    element("title").textContent = header.title;
    for (const method of header.methods) {
      const button = document.createElement("button");
      button.textContent = method;
      button.dataset.method = method;
      button.addEventListener("click", () => this.choose(method));
      element("methods").append(button);
    }
    this.mark();
    element("exposure").addEventListener("input", () => {
      viewer.exposure = 2 ** Number(element("exposure").value);
      this.label();
      viewer.present();
    });
    element("heights").addEventListener("input", () => {
      viewer.heights = 2 ** Number(element("heights").value);
      this.label();
      viewer.touch();
    });
    const [first, last] = header.octaves;
    Object.assign(element("heights"), { min: first, max: last });
    element("reset").addEventListener("click", () => this.reset());
    element("save").addEventListener("click", () => this.save());
    element("fold").addEventListener("click", () => document.body.classList.toggle("folded"));
    const losses = Object.entries(header.loss).map(
      ([method, [mean, most]]) => `${method}: ΔE2000 ${mean.toFixed(2)}, 99 % below ${most.toFixed(2)}`);
    const lines = [`Rounded tables: ${losses.join("; ")}.`];
    if (header.omissions.length) lines.push(`Not shown: ${header.omissions.join("; ")}.`);
    lines.push("No shadows, no light between surfaces.");
    element("about").textContent = lines.join(" ");
    this.label();
  }

  async choose(method) {
    try {
      await this.viewer.choose(method, (text) => this.busy(text));
      this.mark();
    } catch (error) {
      this.fail(error);
    }
    element("busy").hidden = true;
  }

  async busy(text) {
    element("busy").textContent = `${text} …`;
    element("busy").hidden = false;
    await new Promise((resolve) => setTimeout(resolve, 20)); // so that it is seen
  }

  mark() {
    for (const button of element("methods").children)
      button.setAttribute("aria-pressed", button.dataset.method === this.viewer.method);
  }

  label() {
    const stops = Number(element("exposure").value);
    element("exposure_value").textContent = `${stops > 0 ? "+" : stops < 0 ? "−" : ""}${Math.abs(stops).toFixed(1)} EV`;
    element("heights_value").textContent = `× ${this.viewer.heights.toFixed(2)}`;
  }

  reset() {
    const { viewer } = this;
    const { header } = viewer;
    Object.assign(viewer.camera, new Camera(header.camera, header.subject, header.box));
    viewer.sun.lights = new Sun(header.lights, viewer.camera).lights;
    element("exposure").value = element("heights").value = 0;
    viewer.exposure = viewer.heights = 1;
    this.label();
    this.moved();
  }

  save() {
    this.viewer.present(); // what was shown last may be gone
    this.viewer.canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${this.viewer.header.title}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }

  disc() {
    const { sun } = this.viewer;
    const disc = element("disc");
    if (!sun.lights.length) {
      element("light").hidden = true;
      return;
    }
    const choice = element("light_choice");
    choice.hidden = sun.lights.length < 2;
    sun.lights.forEach((light, n) => choice.add(new Option(light.name, n)));
    choice.addEventListener("change", () => {
      sun.chosen = Number(choice.value);
      this.drawDisc();
    });
    const follow = (event) => {
      if (!(event.buttons & 1)) return;
      const box = disc.getBoundingClientRect();
      sun.point = [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
      this.moved();
    };
    disc.addEventListener("pointerdown", (event) => {
      disc.setPointerCapture(event.pointerId);
      follow(event);
    });
    disc.addEventListener("pointermove", follow);
    disc.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      sun.move(0.02 * step[0], 0.02 * step[1]);
      this.moved();
    });
    this.drawDisc();
  }

  drawDisc() {
    const { sun } = this.viewer;
    if (!sun.lights.length) return;
    const [x, y] = sun.point;
    const dot = element("dot");
    dot.setAttribute("cx", 50 * (1 + x));
    dot.setAttribute("cy", 50 * (1 - y));
    dot.classList.toggle("below", Math.hypot(x, y) > HORIZON);
  }

  report(time, count, sample) {
    const digits = time < 10 ? 1 : 0;
    element("time").textContent =
      `${time.toFixed(digits)} ms a frame, ${sample.width} × ${sample.height}\n${count} of ${this.viewer.most} frames averaged`;
  }
}
