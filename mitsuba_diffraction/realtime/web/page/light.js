// Directions on a disc as seen from above, the camera below: the middle is overhead, the inner
// circle the horizon, the rim straight down.

const HORIZON = 0.68;
const POWER = Math.log(HORIZON) / Math.log(0.5);

class Sun {
  constructor(lights, camera) {
    this.lights = lights.map((light) => ({ ...light, place: [...light.place] }));
    this.camera = camera;
    this.chosen = 0;
  }

  // Right, away from the camera, and up.
  frame() {
    const { up } = this.camera;
    const right = unit(times(this.camera.axis(0), -1));
    return [right, cross(up, right), up];
  }

  get light() {
    return this.lights[this.chosen];
  }

  // Where the chosen light is on the disc.
  get point() {
    const { place } = this.light;
    const direction = unit(place[3] ? minus(place, this.camera.target) : place);
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
    const { place } = this.light;
    if (place[3]) {
      const distance = norm(minus(place, this.camera.target));
      this.light.place = [...plus(this.camera.target, direction, distance), 1];
    } else this.light.place = [...direction, 0];
  }

  move(right, away) {
    const [x, y] = this.point;
    this.point = [x + right, y + away];
  }

  uniforms() {
    const places = new Float32Array(16), colours = new Float32Array(12);
    this.lights.forEach(({ place, colour }, n) => {
      const length = place[3] ? 1 : norm(place);
      places.set([place[0] / length, place[1] / length, place[2] / length, place[3]], 4 * n);
      colours.set(colour, 3 * n);
    });
    return { light_place: places, light_colour: colours };
  }
}
