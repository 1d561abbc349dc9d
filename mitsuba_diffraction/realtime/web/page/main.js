// Start of the page: read the data and create the viewer, or show an error.

const state = (name) => (document.documentElement.dataset.state = name);

function show(message, name) {
  element("message").textContent = message;
  element("message").hidden = false;
  state(name);
}

function fail(error) {
  element("busy").hidden = true;
  show(error instanceof Error ? error.message : String(error), "failed");
}

async function busy(text) {
  element("busy").textContent = `${text} …`;
  element("busy").hidden = false;
  await new Promise((resolve) => setTimeout(resolve, 20)); // lets the browser draw the text
}

// Read header and data from the page, and check that they are complete.
function contents() {
  const cut = new Error("This page is incomplete: its data is missing or truncated. Export it again, or copy the whole file.");
  try {
    const header = JSON.parse(element("header").textContent);
    const bytes = bytesOf("data");
    const last = header.sections.at(-1);
    if (bytes.length < last.start + last.length) throw cut;
    return { header, bytes };
  } catch {
    throw cut;
  }
}

function context(canvas, header) {
  if (typeof DecompressionStream === "undefined")
    throw new Error("This browser cannot unpack the page's data (DecompressionStream): update it.");
  const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance", preserveDrawingBuffer: true });
  if (!gl)
    throw new Error(
      "This browser has no WebGL 2. Update it, enable hardware acceleration in its settings, or use another browser.");
  const { tables, surfaces, around } = header;
  const parts = [...Object.values(tables).flat(), ...surfaces.map((surface) => surface.parts), ...(around ? [around.parts, ...around.lobes] : [])];
  const textures = parts.flatMap((part) => part.textures);
  const needs = { EXT_color_buffer_float: "float framebuffers" };
  if (textures.some(({ smooth, kind }) => smooth && kind === "single"))
    needs.OES_texture_float_linear = "linear filtering of float textures";
  for (const [name, words] of Object.entries(needs))
    if (!gl.getExtension(name))
      throw new Error(`This browser's WebGL lacks ${words} (${name}). Update the graphics driver, or use another browser.`);
  const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  const widest = Math.max(...textures.map(({ width, height }) => Math.max(width, height)));
  if (widest > most) throw new Error(`The scene needs textures of ${widest} texels a side; this device supports ${most}.`);
  return gl;
}

// Load what the first picture takes, which is small and has few lights.
async function load(viewer) {
  const { drawing, drawn, material } = viewer, lit = { glance: viewer.lit.glance };
  await drawing.load(drawn, lit, material);
  await drawing.prepare(drawn, lit, busy, material);
  viewer.fit();
  viewer.rehearse();
  await busy("Unpacking meshes");
  await drawing.loadMeshes();
}

// Draw the first picture, and prepare all others.
async function open(viewer) {
  viewer.lost = false;
  viewer.glance();
  element("message").hidden = element("busy").hidden = true;
  state("ready");
  await new Promise(requestAnimationFrame); // lets the browser show it
  viewer.wake();
  await viewer.drawing.prepare(viewer.drawn, viewer.lit, () => {}, viewer.material);
}

async function start() {
  const { header, bytes } = contents();
  document.title = header.title;
  const canvas = element("canvas");
  const gl = context(canvas, header);
  await busy("Reading");
  const data = new Data(bytes, header.sections);
  const viewer = new Viewer(canvas, new Drawing(gl, header, data), header);
  window.viewer = viewer;
  textToView(location.hash.slice(1), viewer);
  await load(viewer);
  viewer.controls = new Controls(viewer, fail);
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    viewer.lost = true;
    show("The graphics driver stopped. The picture returns when the driver restarts; otherwise reload the page.", "lost");
  });
  canvas.addEventListener("webglcontextrestored", async () => {
    try {
      context(canvas, header); // enables the extensions again
      viewer.drawing = new Drawing(gl, header, data);
      viewer.sample = viewer.shown = viewer.controls.map.gl = undefined;
      await load(viewer);
      await open(viewer);
    } catch (error) {
      fail(error);
    }
  });
  // free textures when the page is closed or a notebook's cell is run again
  window.addEventListener("pagehide", ({ persisted }) => {
    if (!persisted) gl.getExtension("WEBGL_lose_context")?.loseContext();
  });
  await open(viewer);
}

start().catch(fail);
