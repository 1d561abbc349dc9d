// A surface's triangles in the graphics card's memory; the other half of geometry.py.

const ATTRIBUTES = { position: 3, normal: 3, tangent: 3, texcoord: 2, colour: 3, axis: 2 };

// Two numbers of sixteen bits to a direction of three (Cigolle et al. 2014).
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
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, direction ? gl.SHORT : gl.FLOAT, direction, stride * values.BYTES_PER_ELEMENT, 0);
  });
  gl.bindVertexArray(null);
  return {
    draw() {
      for (const [location, value] of constants) gl.vertexAttrib4fv(location, value);
      gl.bindVertexArray(array);
      gl.drawArrays(gl.TRIANGLES, 0, count);
      gl.bindVertexArray(null);
    },
  };
}
