// Decode arrays and pictures from the page's text, which sections.py encodes.

function bytesOf(id) {
  const text = atob(document.getElementById(id).textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const ARRAYS = { Uint8Array, Int16Array, Uint16Array, Uint32Array, Float32Array };

// Decode byte planes to rows, and differences to numbers.
function restored(planes, layout) {
  const { rows, columns, differences } = layout;
  const array = new ARRAYS[layout.kind](rows * columns);
  const size = array.BYTES_PER_ELEMENT;
  const bytes = new Uint8Array(array.buffer);
  const width = columns * size;
  for (let plane = 0; plane < width; ++plane) {
    let from = plane * rows;
    for (let to = plane; to < bytes.length; to += width) bytes[to] = planes[from++];
  }
  if (differences)
    for (let i = columns; i < array.length; ++i) array[i] += array[i - columns]; // wraps around
  return array;
}

// Decode integers with the exponent of their step in the last column: floats, or floats that store
// the upper halves of two.
function seriesOf(array, { rows, columns, series }) {
  const floats = new Float32Array(rows * (columns - 1));
  let to = 0;
  for (let from = 0; from < array.length; ++from) {
    const step = 2 ** (array[from + columns - 1] - 128);
    for (const end = from + columns - 1; from < end; ++from) floats[to++] = ((array[from] >>> 1) ^ -(array[from] & 1)) * step;
  }
  if (series === "half") return floats;
  const bits = new Uint32Array(floats.buffer);
  const words = Uint32Array.from({ length: bits.length / 2 }, (_, n) => (bits[2 * n] >>> 16) | (bits[2 * n + 1] & 0xffff0000 || 0x800000));
  return new Float32Array(words.buffer);
}

class Data {
  constructor(bytes, layouts) {
    this.bytes = bytes;
    this.layouts = layouts;
  }

  part(number) {
    const { start, length } = this.layouts[number];
    return this.bytes.subarray(start, start + length);
  }

  async array(number) {
    const layout = this.layouts[number];
    const array = restored(await inflated(this.part(number)), layout);
    return layout.series ? seriesOf(array, layout) : array;
  }

  async text(number) {
    return new TextDecoder().decode(await inflated(this.part(number)));
  }

  async picture(number) {
    const file = new Blob([this.part(number)], { type: "image/webp" });
    return createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  }
}
