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
    return new TextDecoder().decode(await inflated(this.part(number)));
  }

  async picture(number) {
    const file = new Blob([this.part(number)], { type: "image/webp" });
    return createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  }
}
