// Decode a surface's triangles, which sections.py encodes, and upload them.

const ATTRIBUTES = { position: 3, normal: 3, tangent: 3, texcoord: 2, colour: 3, axis: 3 };

// Decode a direction from two 16-bit integers (Cigolle et al. 2014).
function fromOctahedron(a, b, to, at) {
  if (a === -32768) {
    to[at] = to[at + 1] = to[at + 2] = 0;
    return;
  }
  let x = a / 32767, y = b / 32767;
  const z = 1 - Math.abs(x) - Math.abs(y);
  if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
  const scale = 32767 / Math.hypot(x, y, z);
  to[at] = Math.round(x * scale);
  to[at + 1] = Math.round(y * scale);
  to[at + 2] = Math.round(z * scale);
}

async function uploadMesh(gl, data, mesh) {
  const corners = await data.array(mesh.corners);
  const columns = await data.array(mesh.columns);
  const tangents = mesh.tangents === null ? null : await data.array(mesh.tangents);
  const count = corners.length, width = data.layouts[mesh.columns].columns;
  const signed = new Int16Array(columns.buffer);
  const array = gl.createVertexArray(), constants = [];
  let positions;
  gl.bindVertexArray(array);
  Object.entries(ATTRIBUTES).forEach(([name, size], location) => {
    const place = mesh.layout[name];
    if (place && place.value) {
      constants.push([location, [...place.value, 0, 0].slice(0, 4)]);
      return;
    }
    const direction = name === "normal" || name === "tangent";
    // directions are padded to four numbers: attributes start at multiples of four bytes
    const stride = direction ? 4 : size;
    const values = direction ? new Int16Array(count * stride) : new Float32Array(count * stride);
    for (let i = 0; i < count; ++i) {
      const from = corners[i] * width;
      if (name === "tangent" && tangents) {
        const n = 2 * Math.floor(i / 3);
        fromOctahedron(tangents[n], tangents[n + 1], values, i * stride);
      } else if (direction) {
        const n = from + place.column;
        fromOctahedron(signed[n], signed[n + 1], values, i * stride);
      } else {
        for (let c = 0; c < size; ++c)
          values[i * stride + c] = place.low[c] + place.step[c] * columns[from + place.column + c];
      }
    }
    if (name === "position") positions = values;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, direction ? gl.SHORT : gl.FLOAT, direction, stride * values.BYTES_PER_ELEMENT, 0);
  });
  // one buffer for all levels: a vertex array has one index buffer
  const parts = [], lists = [];
  for (const few of FEWER) {
    const list = count > 3 * few ? coarser(positions, few) : null;
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
const CELLS = 100; // cells along the longest side, at most

// Simplify triangles by merging all vertices in a cell (Rossignac and Borrel 1993).
function coarser(positions, most, cells = CELLS) {
  const low = [0, 1, 2].map(() => Infinity), high = [0, 1, 2].map(() => -Infinity);
  for (let i = 0; i < positions.length; ++i) {
    if (positions[i] < low[i % 3]) low[i % 3] = positions[i];
    if (positions[i] > high[i % 3]) high[i % 3] = positions[i];
  }
  const step = cells / Math.max(...high.map((x, n) => x - low[n]), 1e-30);
  const first = new Map();
  const standing = (i) => {
    let key = 0;
    for (let c = 0; c < 3; ++c) key = 1024 * key + Math.floor((positions[3 * i + c] - low[c]) * step);
    if (!first.has(key)) first.set(key, i);
    return first.get(key);
  };
  const found = [];
  for (let i = 0; i < positions.length / 3; i += 3) {
    const a = standing(i), b = standing(i + 1), c = standing(i + 2);
    if (a !== b && b !== c && c !== a) found.push(a, b, c);
  }
  return found.length > 3 * most ? coarser(positions, most, 0.7 * cells) : found;
}
