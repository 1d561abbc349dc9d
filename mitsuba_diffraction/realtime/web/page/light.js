// Lights: those of the scene, or one light instead, each as a sequence of lights without extent.
//
// The panel shows directions on a disc as seen from above, with the camera at the bottom: the middle
// is overhead, the inner circle the horizon, and the rim straight down.

const HORIZON = 0.68;
const POWER = Math.log(HORIZON) / Math.log(0.5);
const SUN = (0.267 * Math.PI) / 180; // radius of the sun's disc
const KINDS = { scene: "The scene's", sun: "Sun", lamp: "Lamp", window: "Window", sky: "Environment" };
const FILL = 0.12; // share of light from a dome beside a light that replaces the scene's
const LUMINANCE = [0.2126, 0.7152, 0.0722];
const DARK = [0, 0, 0];
const DOME = 1e-20; // density of lights of the dome, so low that lobes are left to look it up

// Evenly distributed points, from the middle on, by the plastic number (M. Roberts 2018).
const even = (n) => [(0.5 + n * 0.7548776662) % 1, (0.5 + n * 0.569840291) % 1];

class Lights {
  constructor(header, camera) {
    this.header = header;
    this.camera = camera;
    const { own, sky, samples } = header.light;
    this.kinds = Object.keys(KINDS).filter((kind) => kind !== "scene" || own.length || samples.length);
    this.kind = this.kinds[0];
    this.chosen = 0;
    this.sky = sky;
    this.middle = times(plus(header.subject[0], header.subject[1]), 0.5);
    this.reach = norm(minus(header.subject[1], header.subject[0]));
    this.reset();
    this.level = this.irradiance();
  }

  reset() {
    this.own = this.header.light.own.map((light) => ({ ...light, place: [...light.place] }));
    const { own } = this;
    const first = own.length ? this.towards(own[0].place) : unit(plus(this.camera.up, this.camera.axis(0), 0.5));
    this.direction = dot(first, this.camera.up) > 0.05 ? first : unit(plus(this.camera.up, first, 0.5));
  }

  // Mean luminance of the scene's lights in the middle.
  irradiance() {
    const { samples } = this.header.light;
    const brought = samples.map(({ place, colour }) => {
      const away = minus(place, this.middle);
      return dot(colour, LUMINANCE) / (place[3] ? dot(away, away) : 1);
    });
    return brought.length ? brought.reduce((a, b) => a + b, 0) / brought.length : 3;
  }

  towards(place) {
    return unit(place[3] ? minus(place, this.middle) : place);
  }

  // Axes of the disc: right, away from the camera, and up.
  frame() {
    const { up } = this.camera;
    const right = unit(times(this.camera.axis(0), -1));
    return [right, cross(up, right), up];
  }

  // Position of the movable light on the disc.
  get point() {
    const direction = this.kind === "scene" ? this.towards(this.own[this.chosen].place) : this.direction;
    const [right, away, up] = this.frame();
    const x = dot(direction, right), y = dot(direction, away);
    const radius = Math.pow(Math.acos(clamp(dot(direction, up), -1, 1)) / Math.PI, POWER);
    const length = Math.hypot(x, y);
    return length > 1e-9 ? [(x / length) * radius, (y / length) * radius] : [0, 0];
  }

  set point([x, y]) {
    const radius = Math.min(Math.hypot(x, y), 1);
    const polar = Math.PI * Math.pow(radius, 1 / POWER), turn = Math.atan2(y, x);
    const [right, away, up] = this.frame();
    const level = plus(times(right, Math.cos(turn)), away, Math.sin(turn));
    const direction = plus(times(up, Math.cos(polar)), level, Math.sin(polar));
    if (this.kind !== "scene") {
      this.direction = direction;
      return;
    }
    const light = this.own[this.chosen];
    const distance = light.place[3] ? norm(minus(light.place, this.middle)) : 0;
    light.place = light.place[3] ? [...plus(this.middle, direction, distance), 1] : [...direction, 0];
  }

  // Whether all lights are the scene's, and none with a position has been moved.
  get whole() {
    const was = this.header.light.own;
    return this.kind === "scene" && this.own.every(({ place }, n) => !place[3] || place.every((x, i) => x === was[n].place[i]));
  }

  // Whether a light can be moved.
  get movable() {
    return this.kind !== "scene" || this.own.length > 0;
  }

  move(right, away) {
    const [x, y] = this.point;
    this.point = [x + right, y + away];
  }

  // A few representative lights and a smooth sky, for moving pictures.
  get few() {
    if (this.kind === "scene") return { lights: this.own, sky: this.sky };
    const sky = [0.5, ...times(this.camera.up, 0.5)].flatMap((x) => [x, x, x].map((one) => one * this.dome));
    return { lights: this.kind === "sky" ? [] : [this.made(-1)], sky };
  }

  // Radiance of the dome of a light that replaces the scene's: E/π of a plane that faces it.
  get dome() {
    return this.kind === "scene" ? 0 : ((this.kind === "sky" ? 1 : FILL) * this.level) / Math.PI;
  }

  // Number of different lights in the sequence.
  get count() {
    return this.kind === "scene" ? this.header.light.samples.length : 256;
  }

  // Light number n of the sequence, whose mean is all light.
  sample(n) {
    if (this.kind !== "scene") return this.made(n);
    const { samples } = this.header.light;
    const light = samples[n % samples.length];
    const own = light.of >= 0 && this.own[light.of], was = own && this.header.light.own[light.of];
    if (!own || own.place.every((x, i) => x === was.place[i])) return light;
    const turned = turning(this.towards(was.place), this.towards(own.place));
    const place = light.place[3] ? [...plus(this.middle, turned(minus(light.place, this.middle))), 1] : [...turned(light.place), 0];
    return { ...light, place, axis: turned(light.axis) };
  }

  // Light number n of a kind that replaces the scene's; n = -1 is its middle.
  made(n) {
    const { direction, level: brightness, middle, reach } = this;
    const level = n < 0 ? brightness : (brightness * 4) / 3;
    const filling = this.kind !== "sky" && n >= 0 && n % 4 === 3; // a quarter of all is the dome
    const [x, y] = n < 0 ? [0.5, 0.5] : even(filling ? (n - 3) / 4 : n);
    const across = unit(cross(Math.abs(dot(direction, this.camera.up)) > 0.99 ? this.camera.axis(0) : this.camera.up, direction));
    const upwards = cross(direction, across);
    const light = (place, power, axis = DARK) => ({ place, colour: [power, power, power], axis, cone: [0, 0], spectrum: -1 });
    if (this.kind === "sky" || filling) {
      const { up } = this.camera, cosine = 1 - x, sine = Math.sqrt(1 - cosine * cosine);
      const [right, away] = this.frame();
      const d = plus(plus(times(up, cosine), right, sine * Math.cos(2 * Math.PI * y)), away, sine * Math.sin(2 * Math.PI * y));
      return { ...light([...d, 0], (this.kind === "sky" ? 2 : 8 * FILL) * brightness), density: DOME };
    }
    const radius = n < 0 ? 0 : Math.sqrt(x), turn = 2 * Math.PI * y;
    const round = plus(times(across, radius * Math.cos(turn)), upwards, radius * Math.sin(turn));
    if (this.kind === "sun") return light([...unit(plus(direction, round, SUN)), 0], level);
    if (this.kind === "lamp") {
      const distance = 1.2 * reach;
      return light([...plus(plus(middle, direction, distance), round, 0.03 * distance), 1], level * distance ** 2);
    }
    // four panes
    const pane = (t) => (t < 0.5 ? 0.94 * t : 1 - 0.94 * (1 - t)) - 0.5;
    const distance = 1.5 * reach;
    const place = plus(plus(plus(middle, direction, distance), across, 0.8 * reach * pane(x)), upwards, 1.1 * reach * pane(y));
    return light([...place, 1], level * distance ** 2, times(direction, -1));
  }
}

// Shortest rotation from one direction to another.
function turning(from, to) {
  const axis = cross(from, to), sine = norm(axis);
  if (sine < 1e-9) return (v) => v;
  const angle = Math.atan2(sine, dot(from, to));
  return (v) => rotated(v.slice(0, 3), unit(axis), angle);
}

// Uniforms of lights. colour: of monochromatic light, or null.
function lightUniforms(lights, colour) {
  const places = new Float32Array(16), colours = new Float32Array(12);
  lights.forEach((light, n) => {
    const { place } = light;
    const length = place[3] ? 1 : norm(place);
    places.set([place[0] / length, place[1] / length, place[2] / length, place[3]], 4 * n);
    colours.set(colour ? times(colour, Math.max(dot(light.colour, LUMINANCE), 0)) : light.colour, 3 * n);
  });
  return { light_place: places, light_colour: colours };
}
