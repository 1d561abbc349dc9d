// Decode arrays and pictures from the page's text, which sections.py encodes.

function bytesOf(id) {
  const written = document.getElementById(id).textContent.trim();
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(written);
  const text = atob(written);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const ARRAYS = { Uint8Array, Int16Array, Uint16Array, Uint32Array, Float32Array };
const BLOCK = 1024; // rows at a time, which processors cache

// Decode planes of bytes to rows, and differences of bits to bits.
function restored(planes, { kind, columns, differences }) {
  const size = ARRAYS[kind].BYTES_PER_ELEMENT, width = columns * size, rows = planes.length / width;
  const bytes = new Uint8Array(planes.length);
  for (let first = 0; first < rows; first += BLOCK)
    for (let plane = 0; plane < width; ++plane) {
      const last = plane * rows + Math.min(first + BLOCK, rows);
      for (let from = plane * rows + first, to = first * width + plane; from < last; to += width) bytes[to] = planes[from++];
    }
  if (differences) {
    const bits = new { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[size](bytes.buffer);
    for (let i = columns; i < bits.length; ++i) bits[i] += bits[i - columns]; // wraps around
  }
  return new ARRAYS[kind](bytes.buffer);
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
    return restored(await inflated(this.part(number)), this.layouts[number]);
  }

  async text(number) {
    return new TextDecoder().decode(await this.array(number));
  }

  async picture(number) {
    const file = new Blob([this.part(number)], { type: "image/webp" });
    return createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  }
}
