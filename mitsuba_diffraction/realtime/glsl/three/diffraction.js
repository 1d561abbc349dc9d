// Diffraction as a material of three.js (r158 or later; tested with r187), over a diffuse base of the
// colour `color`, under all lights of the scene, a sampled environment and a mirrored room.
import * as THREE from "three";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";

async function texture(url, { type, filter, wrap }) {
  const loaded = await new EXRLoader().setDataType(type === "half" ? THREE.HalfFloatType : THREE.FloatType).loadAsync(url);
  loaded.magFilter = loaded.minFilter = filter === "linear" ? THREE.LinearFilter : THREE.NearestFilter;
  loaded.wrapS = loaded.wrapT = wrap === "repeat" ? THREE.RepeatWrapping : THREE.ClampToEdgeWrapping;
  loaded.colorSpace = THREE.NoColorSpace;
  loaded.generateMipmaps = false;
  return loaded;
}

// names of its own do not begin with md_, as those of the exported code do
const LIGHT = (name) => `
#ifdef ROOM
uniform sampler2D room_light;
uniform vec3 room_lobe; // (kσ)² of the mirror lobe, for red, green and blue
bool sampled = false;
#endif
void RE_Direct_Orders(IncidentLight light, vec3 position, vec3 normal,
    vec3 eye, vec3 coat, LambertMaterial material, inout ReflectedLight reflected) {
  vec3 s = normalize(vTangent - normal * dot(normal, vTangent)), t = cross(normal, s);
  mat3 frame = mat3(s, t, normal);
  vec3 wi = eye * frame, wo = light.direction * frame;
  vec3 base = saturate(wo.z) * BRDF_Lambert(material.diffuseColor) * diffraction_transmission(wi, wo);
  vec3 orders = ${name}(wi, wo);
#ifdef ROOM
  wi += wo;
  if (sampled) orders *= smoothstep(4.0, 9.0, room_lobe.r * dot(wi.xy, wi.xy));
#endif
  reflected.directDiffuse += light.color * (base + orders);
}
#undef RE_Direct
#define RE_Direct RE_Direct_Orders
#if SAMPLES > 0
uniform vec3 room_samples[2 * SAMPLES];
#endif
`;
// the mirror lobe has the peak R (kσ)²/π
const ENVIRONMENT = `
IncidentLight it;
#define ADD RE_Direct(it, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight)
#ifdef ROOM
it.direction = reflect(-geometryViewDir, geometryNormal);
it.color = textureLod(room_light, equirectUv(inverseTransformDirection(it.direction, viewMatrix)), 0.0).rgb
  * PI / (room_lobe * max(dot(it.direction, geometryNormal), 1e-3));
ADD;
sampled = true;
#endif
#if SAMPLES > 0
for (int n = 0; n < SAMPLES; ++n) {
  it.direction = (viewMatrix * vec4(room_samples[2 * n], 0.0)).xyz;
  it.color = room_samples[2 * n + 1];
  ADD;
}
#endif
`;

// Create the material. folder: folder of constants.json; method: "fast" or "exact"; environment:
// result of `sampled`; room: equirectangular texture that order 0 mirrors; others: parameters of
// MeshLambertMaterial. Geometries need the attribute `tangent` (`computeTangents()`), along the
// patch's x axis.
export async function diffractionMaterial(folder = ".", { method = "fast", environment = [], room = null, ...parameters } = {}) {
  const constants = await (await fetch(`${folder}/constants.json`)).json();
  const code = await (await fetch(`${folder}/diffraction.glsl`)).text();
  const name = constants.functions[method];
  if (!name) throw new Error(`method ${method} was not exported, only ${Object.keys(constants.functions)}`);
  const uniforms = { room_samples: { value: environment }, room_light: { value: room } };
  uniforms.room_lobe = { value: [0.611, 0.549, 0.464].map((length) => ((0.5 * Math.PI * constants.coherence_width) / length) ** 2) };
  for (const [key, value] of Object.entries(constants.uniforms)) uniforms[key] = { value };
  for (const [key, entry] of Object.entries(constants.textures))
    uniforms[key] = { value: await texture(`${folder}/${entry.file}`, entry) };
  const material = new THREE.MeshLambertMaterial({ color: 0, ...parameters });
  material.defines = { USE_TANGENT: "", SAMPLES: environment.length / 2, ...(room && { ROOM: "" }) };
  material.customProgramCacheKey = () => code + name;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    const add = (chunk, text) => (shader.fragmentShader = shader.fragmentShader.replace(`#include <${chunk}>`, text));
    add("lights_lambert_pars_fragment", `#include <lights_lambert_pars_fragment>\n${code}${LIGHT(name)}`);
    if (environment.length || room) add("lights_fragment_end", `${ENVIRONMENT}#include <lights_fragment_end>`);
  };
  return material;
}

// Sample an equirectangular float texture (RGBA): a direction and its irradiance in each of `count`
// parts of equal light.
export function sampled({ image: { data, width, height } }, count = 64) {
  const cell = (2 * Math.PI ** 2) / (width * height), weights = new Float64Array(width * height);
  const latitude = (i) => Math.PI * ((Math.floor(i / width) + 0.5) / height - 0.5);
  let total = 0;
  for (let i = 0; i < weights.length; ++i)
    total += weights[i] = cell * Math.cos(latitude(i)) * (0.2126 * data[4 * i] + 0.7152 * data[4 * i + 1] + 0.0722 * data[4 * i + 2]);
  const found = [];
  for (let n = 0, i = 0, sum = weights[0]; n < count; ++n) {
    while (sum < ((n + 0.5) / count) * total && i < weights.length - 1) sum += weights[++i];
    const level = Math.cos(latitude(i)), turn = 2 * Math.PI * (((i % width) + 0.5) / width - 0.5);
    found.push(new THREE.Vector3(level * Math.cos(turn), Math.sin(latitude(i)), level * Math.sin(turn)));
    found.push(new THREE.Vector3(...data.subarray(4 * i, 4 * i + 3)).multiplyScalar((cell * level * total) / count / weights[i]));
  }
  return found;
}
