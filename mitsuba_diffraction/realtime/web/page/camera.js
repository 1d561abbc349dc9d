// Mitsuba's pinhole camera, which looks along its z axis; y is up and x to the left.

class Camera {
  constructor(described, subject, box) {
    this.described = described;
    this.box = box;
    const middle = times(plus(subject[0], subject[1]), 0.5);
    this.matrix = described.to_world.map((row) => [...row]);
    const distance = dot(minus(middle, this.eye), this.axis(2));
    this.target = plus(this.eye, this.axis(2), distance > 0 ? distance : norm(minus(middle, this.eye)));
    this.reach = norm(minus(subject[1], subject[0]));
    this.up = this.upright();
    // horizontal position and width of the subject in the picture, in tangents of angles
    const toCamera = inverse(this.matrix);
    const across = cornersOf(subject).map((p) => [0, 2].map((n) => dot(toCamera[n], p) + toCamera[n][3])).map(([x, z]) => -x / z);
    const [left, right] = [Math.min(...across), Math.max(...across)];
    this.subject = distance > 0 && Number.isFinite(right - left) ? [0.5 * (left + right), 0.52 * (right - left)] : [0, Infinity];
  }

  // World axis that points up; a camera that looks down at a ground looks against it.
  upright() {
    const axes = [0, 1, 2].flatMap((n) => [1, -1].map((sign) => [0, 1, 2].map((i) => (i === n ? sign : 0))));
    const up = this.axis(1), ahead = this.axis(2);
    const along = (a) => dot(a, up) + (dot(a, ahead) < 1e-3 && dot(a, up) > 0.1 ? 1 : 0);
    return axes.reduce((best, a) => (along(a) > along(best) + 1e-3 ? a : best));
  }

  axis(n) {
    return unit([this.matrix[0][n], this.matrix[1][n], this.matrix[2][n]]);
  }

  get eye() {
    return [this.matrix[0][3], this.matrix[1][3], this.matrix[2][3]];
  }

  get distance() {
    return norm(minus(this.target, this.eye));
  }

  set(axes, eye) {
    this.matrix = [0, 1, 2].map((i) => [axes[0][i], axes[1][i], axes[2][i], eye[i]]);
    this.matrix.push([0, 0, 0, 1]);
  }

  turn(axis, angle) {
    const axes = [0, 1, 2].map((n) => rotated(this.axis(n), axis, angle));
    this.set(axes, plus(this.target, rotated(minus(this.eye, this.target), axis, angle)));
  }

  // Orbit around the target; never over the top, where left and right would be swapped.
  orbit(right, down) {
    this.turn(this.up, -right);
    const height = Math.asin(clamp(-dot(this.axis(2), this.up), -1, 1));
    const limit = Math.PI / 2 - 0.02;
    const change = clamp(height + down, Math.min(-limit, height), Math.max(limit, height)) - height;
    this.turn(unit(cross(this.up, this.axis(2))), change);
  }

  pan(right, down) {
    const step = plus(times(this.axis(0), right), this.axis(1), down);
    this.target = plus(this.target, step);
    this.set([0, 1, 2].map((n) => this.axis(n)), plus(this.eye, step));
  }

  zoom(factor) {
    const distance = clamp(this.distance * factor, 1e-3 * this.reach, 50 * this.reach);
    this.set([0, 1, 2].map((n) => this.axis(n)), plus(this.target, this.axis(2), -distance));
  }

  // Tangents of half the angles of view, and of the middle. The whole picture of the scene fits into
  // the part of the window beside the panel, `free` of its width; in upright windows only the subject.
  view(aspect, free = 1) {
    const { fov, size } = this.described;
    const across = Math.tan((fov * Math.PI) / 360), own = size[0] / size[1];
    if (aspect * free >= own) return [(across / own) * aspect, across / own, 0];
    const [middle, half] = aspect < 0.8 ? this.subject : [0, Infinity];
    const upright = Math.min(across, half) / (aspect * free);
    return [upright * aspect, upright, half < across ? middle : 0];
  }

  // Matrix from world to clip space; `jitter` and `lift` shift the picture, in units of half its size.
  projection(aspect, free, jitter, lift) {
    const toCamera = inverse(this.matrix);
    const [low, high] = this.box;
    const depths = cornersOf(this.box).map((p) => dot(toCamera[2], p) + toCamera[2][3]);
    const outside = [0, 1, 2].map((i) => Math.max(low[i] - this.eye[i], this.eye[i] - high[i], 0));
    const far = Math.max(1.001 * Math.max(...depths), 1e-6, 2 * this.distance);
    const near = Math.max(0.5 * norm(outside), 0.999 * Math.min(...depths), 5e-3 * this.distance);
    const [x, y, middle] = this.view(aspect, free);
    const [right, down] = this.described.offset;
    return product([
      [-1 / x, 0, 2 * right + jitter[0] + free - 1 - middle / x, 0],
      [0, 1 / y, -2 * down + jitter[1] + lift, 0],
      [0, 0, (far + near) / (far - near), (-2 * far * near) / (far - near)],
      [0, 0, 1, 0],
    ], toCamera);
  }
}
