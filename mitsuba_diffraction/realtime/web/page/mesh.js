// Decode a surface's triangles, which sections.py encodes, and upload them.

// Triangles of a surface. Each level of detail is uploaded when it is drawn first: 0 is all, larger
// numbers are fewer. Before `load` one triangle stands for all, in the same formats.
class Mesh {
  constructor(gl, described) {
    Object.assign(this, { gl, described });
    const { width, layout } = described, columns = new Uint16Array(3 * width);
    for (let n = 0; n < 3; ++n) columns[n * width + (layout.position.column ?? 0) + n] = 65535;
    this.fill(new Uint32Array([0, 1, 2]), columns, new Uint16Array(3));
  }

  fill(corners, columns, tangents) {
    Object.assign(this, { corners, columns, tangents, constants: [], lists: [null], levels: [] });
  }

  async load(data) {
    const { corners, columns, tangents } = this.described;
    this.fill(...(await Promise.all([corners, columns, tangents].map((section) => section === null ? null : data.array(section)))));
  }

  // Upload triangles by the numbers of their corners, null for all, with vertices of their own.
  uploaded(chosen) {
    const { gl, corners, columns, tangents } = this, { width, layout } = this.described;
    const array = gl.createVertexArray(), { length } = chosen ?? corners;
    gl.bindVertexArray(array);
    // in the order of surface.vert
    Object.values(layout).forEach(({ value, low, step, column }, location) => {
      if (value) {
        this.constants[location] = [...value, 0, 0].slice(0, 4);
        return;
      }
      const size = low.length, values = new Float32Array(length * size);
      const whole = column === undefined; // triangles have one each
      const rows = whole ? tangents : columns;
      for (let i = 0, to = 0; i < length; ++i) {
        const corner = chosen ? chosen[i] : i;
        const from = whole ? size * ((corner / 3) | 0) : corners[corner] * width + column;
        for (let c = 0; c < size; ++c) values[to++] = low[c] + step[c] * rows[from + c];
      }
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
    });
    gl.bindVertexArray(null);
    return { array, length };
  }

  listed(level) {
    const { lists, columns, corners, described } = this;
    if (lists[level] === undefined) {
      const finer = this.listed(level - 1), few = FEWER[level - 1];
      const fewer = corners.length > 3 * few;
      lists[level] = fewer ? coarser(columns, described.width, described.layout.position, corners, few, finer) : finer;
    }
    return lists[level];
  }

  made(level) {
    const same = level && this.listed(level) === this.listed(level - 1);
    return (this.levels[level] ??= same ? this.made(level - 1) : this.uploaded(this.listed(level)));
  }

  draw(level) {
    const { gl } = this, { array, length } = this.made(level);
    this.constants.forEach((value, location) => gl.vertexAttrib4fv(location, value));
    gl.bindVertexArray(array);
    gl.drawArrays(gl.TRIANGLES, 0, length);
    gl.bindVertexArray(null);
  }
}

const FEWER = [20000, 5000]; // triangles while something moves, for slow software rasterisers
const CELLS = 100; // cells along the longest side, at most, below 128

// Simplify triangles by merging all vertices in a cell (Rossignac and Borrel 1993); finer: numbers of
// the corners of triangles to begin with, null for all. Returns numbers of corners.
function coarser(columns, width, { column, step }, corners, most, finer, cells = CELLS) {
  const [x, y, z] = step.map((x) => (cells * x) / (65536 * Math.max(...step)));
  const cell = new Int32Array(columns.length / width); // of each distinct vertex
  for (let n = 0, at = column; n < cell.length; ++n, at += width)
    cell[n] = (((columns[at] * x) | 0) << 14) | (((columns[at + 1] * y) | 0) << 7) | (columns[at + 2] * z);
  const first = new Int32Array(1 << 21).fill(-1); // corner that stands for all in a cell
  const length = (finer ?? corners).length, found = new Int32Array(length);
  const standing = (i) => {
    const corner = finer ? finer[i] : i, n = cell[corners[corner]];
    return first[n] < 0 ? (first[n] = corner) : first[n];
  };
  let count = 0;
  for (let i = 0; i < length; i += 3) {
    const a = standing(i), b = standing(i + 1), c = standing(i + 2);
    if (a === b || b === c || c === a) continue;
    found[count++] = a;
    found[count++] = b;
    found[count++] = c;
  }
  const kept = found.subarray(0, count);
  return count > 3 * most ? coarser(columns, width, { column, step }, corners, most, kept, 0.7 * cells) : kept;
}
