// What surrounds the scene: its environment, shapes that emit light, and what lobes meet; as
// glsl/stage.py and glsl/surroundings.py have it.

const TILES = [8, 16], TILE = 128; // rows over cosθ and columns around the z axis; texels
const WHITE = { place: [0, 0, 1, 0], colour: [1, 1, 1], axis: DARK, cone: [0, 0], spectrum: -1, density: 0 };
const LOOKED_UP = `#define LOOKED_UP\n#define DEPTH_ROWS ${TILES[0]}\n#define DEPTH_COLUMNS ${TILES[1]}\n`;
// other numbers for each sample, as far apart as they can be (Richtmyer 1951)
const drawnNumbers = (n) => [17, 19, 23].map((prime) => (0.5 + (n + 1) * Math.sqrt(prime)) % 1);

class Surroundings {
  static async load(gl, header, data) {
    const around = new Surroundings(), { parts, lobes, emitting, glow, background, whole } = header.around;
    Object.assign(around, { gl, header: header.around, box: header.box });
    around.part = await Part.load(gl, data, parts);
    around.lobes = [];
    for (const one of lobes) around.lobes.push(await Part.load(gl, data, one));
    around.glowing = [];
    for (const { mesh, radiance } of emitting) around.glowing.push({ mesh: await uploadMesh(gl, data, mesh), radiance });
    around.glow = new Program(gl, header.vertex, glow);
    around.background = background && new Program(gl, whole, background);
    return around;
  }

  // Depths of the scene along many directions, without what directions meet exactly.
  lookAround(header, surfaces) {
    const { gl } = this, [rows, columns] = TILES;
    const solid = this.header.solid.map((n) => surfaces[n]);
    const low = [0, 1, 2].map((i) => Math.min(...solid.map(({ mesh }) => mesh.low[i])));
    const high = [0, 1, 2].map((i) => Math.max(...solid.map(({ mesh }) => mesh.high[i])));
    const all = { ...header, box: [low, high], subject: [low, high] };
    const maps = new ShadowMap(gl, all, TILE, columns * TILE, rows * TILE);
    const views = new Float32Array(12 * rows * columns);
    maps.begin();
    for (let n = 0; n < rows * columns; ++n) {
      const z = (2 * (Math.floor(n / columns) + 0.5)) / rows - 1, turn = (2 * Math.PI * ((n % columns) + 0.5)) / columns;
      const across = Math.sqrt(1 - z * z);
      const { matrix } = maps.parallel([across * Math.cos(turn), across * Math.sin(turn), z], [0.5, 0.5]);
      views.set(matrix.slice(0, 3).flat(), 12 * n);
      gl.viewport((n % columns) * TILE, Math.floor(n / columns) * TILE, TILE, TILE);
      maps.meshes(matrix, solid, 1);
    }
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 3 * rows * columns, 1, 0, gl.RGBA, gl.FLOAT, views);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    this.depths = { maps: maps.texture, views: texture, depth_bias: (1.5 * norm(minus(high, low))) / TILE };
  }

  // For a surface whose lobes look it up.
  use(program, table) {
    this.part.use(program);
    this.lobes[table]?.use(program);
    if (!this.depths) return;
    program.texture("depth_maps", this.depths.maps);
    program.texture("depth_views", this.depths.views);
    program.set({ depth_bias: this.depths.depth_bias });
  }

  // Behind the scene the environment, and what emits light; dark, that only covers.
  draw(view, drawing) {
    const { gl } = this, { uniforms, matrix, bright, width, height } = view;
    if (bright && this.background) {
      gl.disable(gl.DEPTH_TEST);
      this.background.use();
      this.part.use(this.background);
      this.background.set({
        ...uniforms, from_clip: columnMajor(invertible(matrix)), picture_size: [width, height],
      });
      drawing.triangle();
      gl.enable(gl.DEPTH_TEST);
    }
    this.glow.use();
    for (const { mesh, radiance } of this.glowing) {
      this.glow.set({ ...uniforms, radiance: bright ? radiance : DARK });
      mesh.draw(view.detail);
    }
  }
}
