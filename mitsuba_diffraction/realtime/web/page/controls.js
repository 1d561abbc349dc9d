// Controls by mouse, touch, keys and the panel.

const READ = 8000; // ms until the hint fades
const METHODS = { fast: "Colours summed up beforehand", exact: "Every wavelength by itself" };

const element = (id) => document.getElementById(id);

// Linear sRGB of a colour input's text.
const colourOf = (text) => [1, 3, 5].map((n) => parseInt(text.slice(n, n + 2), 16) / 255).map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));

class Controls {
  constructor(viewer, fail) {
    this.viewer = viewer;
    this.fail = fail;
    this.pointers = new Map();
    this.canvas();
    this.map = new BrdfMap(viewer, element("map"), element("map_words"));
    this.panel();
    this.disc();
    this.grip();
    this.link();
    viewer.report = (sample, count) => this.report(sample, count);
    this.all();
  }

  // Set the panel to the viewer's state.
  all() {
    const { viewer } = this;
    element("exposure").value = Math.log2(viewer.exposure);
    element("heights").value = Math.log2(viewer.heights);
    element("wavelength").value = viewer.wavelength ?? 375;
    element("turn").value = viewer.turn;
    element("coherence").value = Math.log2(viewer.coherence);
    element("material").value = viewer.material ?? "";
    if (viewer.pigment) element("pigment").value = viewer.pigment;
    element("shadows").checked = viewer.shadows;
    element("kind").value = viewer.lights.kind;
    this.label();
    this.drawDisc();
  }

  canvas() {
    const { canvas, camera } = this.viewer;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, event);
      element("hint").classList.add("gone");
      this.look(event);
    });
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("pointerleave", () => clearTimeout(this.looking));
    canvas.addEventListener("pointermove", (event) => {
      const before = this.pointers.get(event.pointerId);
      if (!before) {
        this.look(event);
        return;
      }
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

  // Update the BRDF map of the point under the cursor.
  look({ clientX, clientY }) {
    if (!element("map_of").open) return;
    this.map.at = [clientX, clientY];
    clearTimeout(this.looking);
    this.looking = setTimeout(() => this.map.update(), 30);
  }

  // Store the view in the page's address while nothing moves.
  link() {
    const { viewer } = this;
    this.linked = setInterval(() => {
      if (viewer.moving || viewer.lost) return;
      const text = `#${viewToText(viewer)}`;
      if (text === this.address) return;
      if (this.address !== undefined)
        try {
          history.replaceState(null, "", text);
        } catch {
          clearInterval(this.linked); // a cell of a notebook has no address
        }
      this.address = text;
    }, 500);
    window.addEventListener("hashchange", async () => {
      textToView(location.hash.slice(1), viewer);
      await this.change({});
      this.all();
    });
    element("link").addEventListener("click", async () => {
      const text = `${location.href.split("#")[0]}#${viewToText(viewer)}`;
      try {
        await navigator.clipboard.writeText(text);
        this.say("Link copied");
      } catch {
        prompt("The link", text);
      }
    });
  }

  say(text) {
    element("hint").textContent = text;
    element("hint").classList.remove("gone");
    setTimeout(() => element("hint").classList.add("gone"), 2000);
  }

  // Place the picture beside the panel if the window is wide enough, or above it on narrow screens.
  arrange() {
    const { viewer } = this;
    const { clientWidth: whole, clientHeight: high } = viewer.canvas;
    const { offsetWidth: wide, offsetHeight: tall } = element("panel");
    const open = !document.body.matches(".folded, .bare");
    const sheet = open && wide === whole;
    const free = open && !sheet && whole > 2 * wide + 24 ? 1 - (wide + 12) / whole : 1;
    const lift = sheet ? tall / high : 0;
    viewer.fit();
    if (free === viewer.free && lift === viewer.lift) return;
    Object.assign(viewer, { free, lift });
    viewer.touch();
  }

  drag(before, event) {
    const { camera, lights, canvas } = this.viewer;
    const right = event.clientX - before.clientX, down = event.clientY - before.clientY;
    if (event.shiftKey || event.buttons & 2 || this.movesLight) {
      if (lights.movable) lights.move(right / 220, -down / 220);
    } else if (event.ctrlKey || event.metaKey || event.buttons & 4) this.pan(right, down);
    else camera.orbit((3 * right) / canvas.clientHeight, (3 * down) / canvas.clientHeight);
  }

  pan(right, down) {
    const { camera, canvas } = this.viewer;
    const step = (2 * camera.view(canvas.clientWidth / canvas.clientHeight, this.viewer.free)[1] * camera.distance) / canvas.clientHeight;
    camera.pan(right * step, down * step);
  }

  // Two fingers: pan by their middle, zoom by their distance.
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
      button.title = METHODS[method];
      button.dataset.method = method;
      button.addEventListener("click", () => this.change({ method }));
      element("methods").append(button);
    }
    for (const kind of viewer.lights.kinds) element("kind").add(new Option(KINDS[kind], kind));
    element("kind").addEventListener("change", () => this.change({ kind: element("kind").value }));
    element("shadows").addEventListener("change", () => {
      viewer.shadows = element("shadows").checked;
      viewer.touch();
    });
    element("wavelength").parentElement.hidden = !header.methods.includes("exact");
    element("wavelength").addEventListener("input", () => this.scrub(Number(element("wavelength").value)));
    element("map_of").addEventListener("toggle", () => element("map_of").open && this.map.update());
    element("exposure").addEventListener("input", () => {
      viewer.exposure = 2 ** Number(element("exposure").value);
      this.label();
      viewer.present();
    });
    this.surface();
    element("reset").addEventListener("click", () => this.reset());
    element("save").addEventListener("click", () => this.save());
    element("fold").addEventListener("click", () => document.body.classList.toggle("folded"));
    if (matchMedia("(max-width: 560px)").matches) document.body.classList.add("folded");
    if (matchMedia("(pointer: coarse)").matches) element("hint").textContent = "One finger turns · two zoom · ☀ moves the light";
    setTimeout(() => element("hint").classList.add("gone"), READ);
    const losses = Object.entries(header.loss).map(
      ([method, [mean, most]]) => `${method}: ΔE2000 ${mean.toFixed(2)}, 99 % below ${most.toFixed(2)}`);
    const lines = [`Error of rounded colours: ${losses.join("; ")}; 1 is just visible.`];
    if (header.omissions.length) lines.push(`Not shown: ${header.omissions.join("; ")}.`);
    for (const [method, reason] of Object.entries(header.left_out)) lines.push(`Without ${method}: ${reason}.`);
    lines.push("Sliders and materials change direct light; energy is conserved for the scene's material. Light between surfaces is a mean over small parts of the scene, in the scene's own light. While something moves, a few lights represent all, without it. Lights other than the scene's and moved lights are sets of points, without reflections of their shapes in narrow lobes.");
    element("about").textContent = lines.join(" ");
  }

  // Controls of what diffracts, where the scene has a surface that they change.
  surface() {
    const { viewer } = this, { header } = viewer;
    const slide = (name, change) => element(name).addEventListener("input", () => {
      change(element(name).value);
      this.label();
      viewer.touch();
      this.map.update();
    });
    const [min, max] = header.octaves;
    Object.assign(element("heights"), { min, max });
    slide("heights", (value) => (viewer.heights = 2 ** Number(value)));
    slide("turn", (value) => (viewer.turn = Number(value)));
    slide("pigment", (value) => (viewer.pigment = value));
    element("pigment").parentElement.hidden = !header.surfaces.some(({ pigmented }) => pigmented);
    element("coherence").parentElement.hidden = !header.methods.includes("exact");
    element("coherence").addEventListener("input", () => this.change({ coherence: 2 ** Number(element("coherence").value) }));
    element("material").parentElement.hidden = !header.materials.length;
    element("material").add(new Option("The scene's", ""));
    header.materials.forEach(({ name }, n) => element("material").add(new Option(name, n)));
    element("material").addEventListener("change", ({ target: { value } }) => this.change({ material: value === "" ? null : Number(value) }));
  }

  // Button for touch screens: one finger moves the light instead of turning.
  grip() {
    const grip = element("grip");
    grip.hidden = !this.viewer.lights.movable;
    grip.addEventListener("click", () => {
      this.movesLight = !this.movesLight;
      grip.setAttribute("aria-pressed", this.movesLight);
      this.say(this.movesLight ? "One finger moves the light" : "One finger turns");
    });
  }

  // Choose one wavelength, or all at the left end of the slider.
  scrub(nm) {
    const wavelength = nm < 380 ? null : nm;
    if (wavelength !== null && this.viewer.wavelength !== null) {
      this.viewer.wavelength = wavelength; // the programs are compiled already
      this.viewer.touch();
      this.label();
      this.map.update();
    } else return this.change({ wavelength });
  }

  async change(change) {
    try {
      await this.viewer.change(change, busy);
      this.label();
      this.drawDisc();
      this.map.update();
    } catch (error) {
      this.fail(error);
    }
    element("busy").hidden = true;
  }

  // Mark the method, and write the values beside the sliders.
  label() {
    for (const button of element("methods").children)
      button.setAttribute("aria-pressed", button.dataset.method === this.viewer.method);
    const stops = Number(element("exposure").value);
    element("exposure_value").textContent = `${stops > 0 ? "+" : stops < 0 ? "−" : ""}${Math.abs(stops).toFixed(1)} EV`;
    element("heights_value").textContent = `× ${this.viewer.heights.toFixed(2)}`;
    element("turn_value").textContent = `${this.viewer.turn}°`;
    element("coherence_value").textContent = `× ${this.viewer.coherence.toFixed(2)}`;
    element("pigment_value").textContent = this.viewer.pigment ? "" : "the scene's";
    const { wavelength } = this.viewer;
    element("wavelength_value").textContent = wavelength === null ? "all" : `${wavelength} nm`;
  }

  reset() {
    const { viewer } = this;
    const { header } = viewer;
    Object.assign(viewer.camera, new Camera(header.camera, header.subject, header.box));
    viewer.lights.reset();
    const { wavelength, coherence, material, ...others } = PLAIN; // the first need other programs
    Object.assign(viewer, others);
    this.change({ wavelength, coherence, material, kind: viewer.lights.kinds[0] });
    this.all();
    this.moved();
  }

  save() {
    this.viewer.present(); // the browser may have cleared the canvas
    this.viewer.canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${this.viewer.header.title}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }

  disc() {
    const { lights } = this.viewer;
    const disc = element("disc");
    const choice = element("light_choice");
    lights.own.forEach((light, n) => choice.add(new Option(light.name, n)));
    choice.addEventListener("change", () => {
      lights.chosen = Number(choice.value);
      this.drawDisc();
    });
    const follow = (event) => {
      if (!(event.buttons & 1)) return;
      const box = disc.getBoundingClientRect();
      lights.point = [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
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
      lights.move(0.02 * step[0], 0.02 * step[1]);
      this.moved();
    });
    this.drawDisc();
  }

  drawDisc() {
    const { lights } = this.viewer;
    element("light_choice").hidden = lights.kind !== "scene" || lights.own.length < 2;
    element("disc").style.display = lights.movable && lights.kind !== "sky" ? "" : "none";
    if (!lights.movable) return;
    const [x, y] = lights.point;
    const dot = element("dot");
    dot.setAttribute("cx", 50 * (1 + x));
    dot.setAttribute("cy", 50 * (1 - y));
    dot.classList.toggle("below", Math.hypot(x, y) > HORIZON);
  }

  report(sample, count) {
    const { time, width, height, preview } = sample;
    const digits = time < 10 ? 1 : 0, { enough } = this.viewer;
    const many = preview ? "" : `\n${count} of ${enough} ${this.viewer.shadows ? "lights" : "frames"} averaged`;
    element("time").textContent = `${time.toFixed(digits)} ms a frame, ${width} × ${height}${many}`;
  }
}
