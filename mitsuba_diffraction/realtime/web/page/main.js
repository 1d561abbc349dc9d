// From the page's data to a viewer, or to words about why not.

function fail(error) {
  const text = error instanceof Error ? error.message : String(error);
  element("message").textContent = text;
  element("message").hidden = false;
  element("busy").hidden = true;
  document.documentElement.dataset.state = "failed";
}

function context(canvas, header) {
  if (typeof DecompressionStream === "undefined")
    throw new Error("This browser cannot unpack the page's data (DecompressionStream): update it.");
  const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance", preserveDrawingBuffer: true });
  if (!gl)
    throw new Error(
      "This browser has no WebGL 2. Update it, switch on hardware acceleration in its settings, or take another one.");
  const textures = [
    ...Object.values(header.tables).flat(), header.responses, ...header.surfaces.map((surface) => surface.parts),
  ].flatMap((part) => part.textures);
  const needs = { EXT_color_buffer_float: "pictures of floats" };
  if (textures.some(({ smooth, kind }) => smooth && kind === "single"))
    needs.OES_texture_float_linear = "linear filtering of float textures";
  for (const [name, words] of Object.entries(needs))
    if (!gl.getExtension(name))
      throw new Error(`This browser's WebGL lacks ${words} (${name}). Update the graphics driver, or take another browser.`);
  const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  const widest = Math.max(...textures.map(({ width, height }) => Math.max(width, height)));
  if (widest > most) throw new Error(`The scene needs textures of ${widest} texels a side; this device has ${most}.`);
  return gl;
}

async function start() {
  const header = JSON.parse(element("header").textContent);
  document.title = header.title;
  const canvas = element("canvas");
  const gl = context(canvas, header);
  canvas.addEventListener("webglcontextlost", () => fail("The graphics driver stopped. Load the page again."));
  const progress = async (text) => {
    element("busy").textContent = `${text} …`;
    element("busy").hidden = false;
    await new Promise((resolve) => setTimeout(resolve, 0));
  };
  await progress("Reading");
  const data = new Data(bytesOf("data"), header.sections);
  const drawing = await Drawing.load(gl, header, data, progress);
  const viewer = new Viewer(canvas, drawing, header);
  await drawing.prepare(viewer.method, progress);
  viewer.fit();
  window.viewer = viewer;
  viewer.controls = new Controls(viewer, fail);
  await viewer.settled(1);
  element("busy").hidden = true;
  document.documentElement.dataset.state = "ready";
}

start().catch(fail);
