// View of the page as text in its address, after the #.

const numbers = (list) => list.map((x) => Number(x.toPrecision(6))).join(",");
const listed = (text, n) => {
  const found = (text ?? "").split(",").map(Number);
  return found.length === n && found.every(Number.isFinite) ? found : null;
};

function viewToText(viewer) {
  const { camera, lights } = viewer;
  const found = {
    eye: numbers(camera.eye), target: numbers(camera.target), x: numbers(camera.axis(0)),
    method: viewer.method, light: lights.kind, towards: numbers(lights.direction),
    exposure: Number(Math.log2(viewer.exposure).toFixed(2)), heights: Number(Math.log2(viewer.heights).toFixed(3)),
  };
  if (viewer.turn) found.turn = viewer.turn;
  if (viewer.coherence !== 1) found.coherence = Number(Math.log2(viewer.coherence).toFixed(2));
  if (viewer.pigment) found.pigment = viewer.pigment.slice(1);
  if (viewer.material !== null) found.material = viewer.header.materials[viewer.material].name;
  if (lights.own.length) found.places = numbers(lights.own.flatMap(({ place }) => place));
  if (viewer.wavelength !== null) found.nm = viewer.wavelength;
  if (!viewer.shadows) found.shadows = 0;
  return new URLSearchParams(found).toString().replaceAll("%2C", ",");
}

// Set the view from the text of an address; invalid parts keep their defaults.
function textToView(text, viewer) {
  const given = new URLSearchParams(text), { camera, lights, header } = viewer;
  const [eye, target, x] = ["eye", "target", "x"].map((name) => listed(given.get(name), 3));
  if (eye && target && x && norm(minus(target, eye)) > 0 && norm(x) > 0) {
    const ahead = unit(minus(target, eye));
    const right = unit(minus(x, times(ahead, dot(x, ahead))));
    camera.target = target;
    camera.set([right, cross(ahead, right), ahead], eye);
  }
  const towards = listed(given.get("towards"), 3);
  if (towards && norm(towards) > 0) lights.direction = unit(towards);
  const places = listed(given.get("places"), 4 * lights.own.length);
  if (places) lights.own.forEach((light, n) => (light.place = places.slice(4 * n, 4 * n + 4)));
  const number = (name, low, high) => {
    const value = Number(given.get(name) ?? NaN);
    return Number.isFinite(value) ? clamp(value, low, high) : 0;
  };
  viewer.exposure = 2 ** number("exposure", -5, 5);
  viewer.heights = 2 ** number("heights", ...header.octaves);
  viewer.turn = number("turn", -90, 90);
  viewer.coherence = header.methods.includes("exact") ? 2 ** number("coherence", -3, 0) : 1;
  viewer.pigment = /^[0-9a-f]{6}$/.test(given.get("pigment") ?? "") ? `#${given.get("pigment")}` : null;
  const material = header.materials.findIndex(({ name }) => name === given.get("material"));
  viewer.material = material < 0 ? null : material;
  viewer.shadows = given.get("shadows") !== "0";
  const nm = Number(given.get("nm") ?? NaN);
  if (header.methods.includes("exact") && nm >= 380 && nm <= 780) viewer.wavelength = nm;
  if (header.methods.includes(given.get("method"))) viewer.method = given.get("method");
  if (lights.kinds.includes(given.get("light"))) lights.kind = given.get("light");
}
