// Surroundings of the scene: environment, and look-ups along lobes, like glsl/progressive.py and
// glsl/surroundings.py.

const WHITE = { place: [0, 0, 1, 0], colour: [1, 1, 1], axis: DARK, cone: [0, 0], spectrum: -1, density: 0 };
// Numbers of each sample, like glsl/progressive.py.
const drawnNumbers = (n) => [0.5 + Math.sqrt(1.25), Math.sqrt(19)].map((step) => (0.5 + (n + 1) * step) % 1);

class Surroundings {
  static async load(gl, header, data) {
    const around = new Surroundings(), { parts, lobes, background } = header.around;
    around.gl = gl;
    around.part = await Part.load(gl, data, parts);
    around.lobes = await Promise.all(lobes.map((one) => Part.load(gl, data, one)));
    around.background = background && new Program(gl, header.shown.vertex, background);
    return around;
  }

  // Bind the data for a surface whose lobes look up the surroundings.
  use(program, table) {
    this.part.use(program);
    this.lobes[table]?.use(program);
  }

  // Draw the environment in the background.
  draw({ uniforms, matrix, up, width, height }, drawing) {
    const { gl } = this;
    gl.disable(gl.DEPTH_TEST);
    this.background.use();
    this.part.use(this.background);
    this.background.set({
      ...uniforms, from_clip: columnMajor(inverse(matrix)), picture_size: [width, height],
      horizon: up, // a sky that is dark below is mirrored at the horizon
    });
    drawing.triangle();
    gl.enable(gl.DEPTH_TEST);
  }
}
