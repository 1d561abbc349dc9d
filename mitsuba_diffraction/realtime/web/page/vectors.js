// Vectors are arrays of three numbers; matrices are arrays of four rows, for column vectors.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b, f = 1) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
const minus = (a, b) => plus(a, b, -1);
const times = (a, f) => [a[0] * f, a[1] * f, a[2] * f];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.sqrt(dot(a, a));
const unit = (a) => times(a, 1 / Math.max(norm(a), 1e-30));
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// Rodrigues' rotation of a vector around a unit axis.
function rotated(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return plus(plus(times(v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
}

const product = (a, b) => a.map((row) => [0, 1, 2, 3].map((j) => row.reduce((t, x, k) => t + x * b[k][j], 0)));

const transposed = (m) => m.map((_, i) => m.map((row) => row[i]));

const columnMajor = (m) => new Float32Array(transposed(m).flat());

// Inverse of a matrix, by Gauss and Jordan.
function inverse(m) {
  const rows = m.map((row, i) => [...row, ...row.map((_, j) => (i === j ? 1 : 0))]);
  for (let c = 0; c < rows.length; ++c) {
    let best = c;
    for (let r = c; r < rows.length; ++r) if (Math.abs(rows[r][c]) > Math.abs(rows[best][c])) best = r;
    [rows[c], rows[best]] = [rows[best], rows[c]];
    rows[c] = rows[c].map((x) => x / rows[c][c]);
    rows.forEach((row, r) => {
      if (r !== c) rows[r] = row.map((x, i) => x - row[c] * rows[c][i]);
    });
  }
  return rows.map((row) => row.slice(m.length));
}

const cornersOf = (box) => [0, 1, 2, 3, 4, 5, 6, 7].map((n) => [0, 1, 2].map((i) => box[(n >> i) & 1][i]));
