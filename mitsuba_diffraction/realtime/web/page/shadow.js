// Shadow maps like glsl/shadows.py, of the subject and its neighbourhood.

const BIAS = 0.75, STEEPEST = 16; // texels, see glsl/shadows.py

class ShadowMap {
  constructor(gl, header, size) {
    Object.assign(this, { gl, size });
    const { box, subject, shadow } = header;
    this.program = new Program(gl, header.vertex, shadow);
    this.texture = texels(gl, gl.DEPTH_COMPONENT32F, size, size);
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.texture, 0);
    gl.drawBuffers([gl.NONE]);
    // depths include the whole scene, which may shade; the map covers the subject and its shadows
    this.corners = cornersOf(box);
    const room = 0.8 * norm(minus(subject[1], subject[0]));
    const around = [0, 1].map((n) => subject[n].map((x, i) => clamp(x + (n ? room : -room), box[0][i], box[1][i])));
    this.covered = cornersOf(around);
  }

  // Draw the map of a light and return uniforms; n: number that shifts the map within a texel.
  draw(light, casters, detail, n) {
    const { gl, size } = this;
    // reuse the map while only the camera moves
    const key = String([light.place, light.axis, light.cone, casters.length, detail, n]);
    if (key === this.key) return this.uniforms;
    this.key = key;
    const shift = even(n + 0.37);
    const { matrix, scale } = light.place[3] ? this.perspective(light.place, shift) : this.parallel(unit(light.place), shift);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, size, size);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.program.use();
    this.program.set({ view_projection: columnMajor(matrix) });
    for (const { mesh } of casters) mesh.draw(detail);
    const [cutoff, beam] = light.cone;
    return (this.uniforms = {
      light_axis: light.axis,
      light_cone: cutoff ? [cutoff, 1 / Math.max(cutoff - beam, 1e-6)] : [0, 0],
      shadow_matrix: columnMajor(matrix),
      shadow_planes: columnMajor(transposed(inverse(matrix))),
      shadow_bias: BIAS * scale,
      shadow_steepest: STEEPEST * scale,
    });
  }

  bounds(seen, shift) {
    const low = [0, 1].map((i) => Math.min(...seen.map((p) => p[i]))), high = [0, 1].map((i) => Math.max(...seen.map((p) => p[i])));
    const half = [0, 1].map((i) => 0.51 * Math.max(high[i] - low[i], 1e-6) * (1 + 4 / this.size));
    return half.map((h, i) => [0.5 * (low[i] + high[i]) + ((shift[i] - 0.5) * 2 * h) / this.size, h]);
  }

  parallel(towards, shift) {
    const axes = axesAlong(times(towards, -1));
    const sides = this.bounds(this.covered.map((p) => axes.map((a) => dot(a, p))), shift);
    const depths = this.corners.map((p) => dot(axes[2], p));
    const low = Math.min(...depths), high = Math.max(...depths), room = 1e-3 * (high - low) + 1e-6;
    const half = 0.5 * (high - low) + room, middle = 0.5 * (high + low);
    const rows = sides.map(([m, h], i) => [...times(axes[i], 1 / h), -m / h]);
    return {
      matrix: [...rows, [...times(axes[2], 1 / half), -middle / half], [0, 0, 0, 1]],
      scale: (2 * Math.max(sides[0][1], sides[1][1])) / this.size / half,
    };
  }

  perspective(eye, shift) {
    const away = this.covered.map((p) => unit(minus(p, eye)));
    const axes = axesAlong(unit(away.reduce((a, b) => plus(a, b))));
    const seen = away.filter((a) => dot(a, axes[2]) > 0.1).map((a) => axes.map((axis) => dot(a, axis) / dot(a, axes[2])));
    const sides = this.bounds(seen.length ? seen : [[0, 0]], shift);
    const depths = this.corners.map((p) => dot(axes[2], minus(p, eye)));
    const far = Math.max(1.001 * Math.max(...depths), 1e-6), near = Math.max(0.999 * Math.min(...depths), 5e-3 * far);
    const rows = sides.map(([m, h], i) => plus(times(axes[i], 1 / h), axes[2], -m / h));
    rows.push(times(axes[2], (far + near) / (far - near)), axes[2]);
    const last = [0, 0, (-2 * far * near) / (far - near), 0];
    return {
      matrix: rows.map((row, n) => [...row, last[n] - dot(row, eye)]),
      scale: (((2 * Math.max(sides[0][1], sides[1][1])) / this.size) * 2 * far * near) / (far - near),
    };
  }
}

function axesAlong(axis) {
  const smallest = axis.reduce((best, x, i) => (Math.abs(x) < Math.abs(axis[best]) ? i : best), 0);
  const first = unit(cross([0, 1, 2].map((i) => (i === smallest ? 1 : 0)), axis));
  return [first, cross(axis, first), axis];
}
