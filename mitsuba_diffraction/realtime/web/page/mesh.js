// Decode a surface's triangles, which sections.py encodes, and upload them.

const ATTRIBUTES = { position: 3, normal: 3, tangent: 3, texcoord: 2, colour: 3, axis: 3 };

const UNIT = 8191, NO_DIRECTION = -8192; // see sections.py

// Decode directions, four numbers each, from two integers in each row (Cigolle et al. 2014).
function directions(rows, width, column) {
  const found = new Int16Array((4 * rows.length) / width);
  for (let from = column, at = 0; at < found.length; from += width, at += 4) {
    if (rows[from] === NO_DIRECTION) continue;
    let x = rows[from] / UNIT, y = rows[from + 1] / UNIT;
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
    const scale = 32767 / Math.sqrt(x * x + y * y + z * z);
    found[at] = Math.round(x * scale);
    found[at + 1] = Math.round(y * scale);
    found[at + 2] = Math.round(z * scale);
  }
  return found;
}

async function uploadMesh(gl, data, mesh) {
  const corners = await data.array(mesh.corners);
  const columns = await data.array(mesh.columns);
  const tangents = mesh.tangents === null ? null : await data.array(mesh.tangents);
  const count = corners.length, { width } = mesh;
  const signed = new Int16Array(columns.buffer, 0, columns.length);
  const array = gl.createVertexArray(), constants = [];
  gl.bindVertexArray(array);
  Object.entries(ATTRIBUTES).forEach(([name, size], location) => {
    const place = mesh.layout[name];
    if (place && place.value) {
      constants.push([location, [...place.value, 0, 0].slice(0, 4)]);
      return;
    }
    const direction = name === "normal" || name === "tangent";
    // directions have a fourth number, which shaders ignore: drivers convert three short ones slowly
    const stride = direction ? 4 : size;
    const values = direction ? new Int16Array(count * stride) : new Float32Array(count * stride);
    if (direction) {
      const flat = name === "tangent" && tangents;
      const found = flat ? directions(tangents, 2, 0) : directions(signed, width, place.column);
      for (let i = 0, to = 0; i < count; ++i) {
        const from = 4 * (flat ? Math.floor(i / 3) : corners[i]);
        for (let c = 0; c < 4; ++c) values[to++] = found[from + c];
      }
    } else {
      const { low, step, column } = place;
      for (let i = 0, to = 0; i < count; ++i) {
        const from = corners[i] * width + column;
        for (let c = 0; c < size; ++c) values[to++] = low[c] + step[c] * columns[from + c];
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, stride, direction ? gl.SHORT : gl.FLOAT, direction, 0, 0);
  });
  // one buffer for all levels: a vertex array has one index buffer
  const parts = [], lists = [];
  for (const few of FEWER) {
    const list = count > 3 * few ? coarser(columns, width, mesh.layout.position, corners, few, lists.at(-1)) : null;
    parts.push(list && { first: lists.reduce((sum, { length }) => sum + length, 0), length: list.length });
    if (list) lists.push(list);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(lists.flat()), gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return {
    // detail: 0 draws all triangles, larger numbers fewer
    draw(detail) {
      const few = detail ? parts[detail - 1] : null;
      for (const [location, value] of constants) gl.vertexAttrib4fv(location, value);
      gl.bindVertexArray(array);
      if (few) gl.drawElements(gl.TRIANGLES, few.length, gl.UNSIGNED_INT, 4 * few.first);
      else gl.drawArrays(gl.TRIANGLES, 0, count);
      gl.bindVertexArray(null);
    },
  };
}

const FEWER = [20000, 5000]; // triangles while something moves, for slow software rasterisers
const CELLS = 100; // cells along the longest side, at most, below 128

// Simplify triangles by merging all vertices in a cell (Rossignac and Borrel 1993); finer: numbers of
// the corners of triangles to begin with, by default all.
function coarser(columns, width, { column, step }, corners, most, finer, cells = CELLS) {
  const places = step.map((x) => (cells * x) / (65536 * Math.max(...step)));
  const cell = new Int32Array(columns.length / width); // of each distinct vertex
  for (let n = 0; n < cell.length; ++n)
    for (let c = 0; c < 3; ++c) cell[n] = (cell[n] << 7) | (columns[n * width + column + c] * places[c]);
  const first = new Int32Array(1 << 21).fill(-1); // corner that stands for all in a cell
  const standing = (i) => {
    const corner = finer ? finer[i] : i, n = cell[corners[corner]];
    return first[n] < 0 ? (first[n] = corner) : first[n];
  };
  const found = [], count = (finer ?? corners).length;
  for (let i = 0; i < count; i += 3) {
    const a = standing(i), b = standing(i + 1), c = standing(i + 2);
    if (a !== b && b !== c && c !== a) found.push(a, b, c);
  }
  return found.length > 3 * most ? coarser(columns, width, { column, step }, corners, most, found, 0.7 * cells) : found;
}
