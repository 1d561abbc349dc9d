"""N' of pairs by the functions that shaders have: GLSL by OpenGL, OSL by Cycles in Blender."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from mitsuba_diffraction.optics.boundary import Model
from mitsuba_diffraction.osl.formulas import patch_formulas
from mitsuba_diffraction.realtime.glsl.formulas import formulas
from tests.support.blender import PLANE, result_of
from tests.support.directions import Array
from tests.support.formulas import COAT, Pairs

VERTEX = """#version 330
const float PI = 3.14159265358979;
float arcsine(float x) {{ return asin(x); }}
{functions}
in vec3 wi; in vec3 wo; in vec2 heights; out float result;
void main()
{{
    {body}
    gl_Position = vec4(heights, 0.0, 1.0);  // keeps them where a model reads none
    result = pair_power(a, b, {index}, heights.x, heights.y{outside});
}}
"""


def shaded(gl: Any, given: Pairs, model: Model, index: complex, coated: bool) -> Array:
    """N' of pairs by the functions that the renderer's shaders have."""
    real = index.imag == 0.0
    n = COAT if coated else 1.0
    relative = index / n
    text = f"{relative.real:.9g}" if real else f"vec2({relative.real:.9g}, {relative.imag:.9g})"
    definitions = {"BOUNDARY": model.name, "SURFACE_KIND": "1" if real else "2"}
    body = "vec3 a = wi, b = wo;\n"
    if coated:
        definitions["COATED"] = ""
        body = f"vec3 a = refracted(wi, {n}), b = refracted(wo, {n});\n"
    outside = f", {n}, wi.z, wo.z" if coated else ""
    source = VERTEX.format(functions=formulas(definitions), body=body, index=text, outside=outside)
    program = gl.program(vertex_shader=source, varyings=["result"])
    heights = np.stack([given.kappa, given.variance], axis=1)
    data = np.concatenate([given.wi, given.wo, heights], axis=1).astype("f4")
    buffer, output = gl.buffer(data.tobytes()), gl.buffer(reserve=4 * len(data))
    lanes = gl.vertex_array(program, [(buffer, "3f 3f 2f", "wi", "wo", "heights")])
    frame = gl.simple_framebuffer((1, 1))
    frame.use()
    lanes.transform(output, vertices=len(data), mode=0)
    found = np.frombuffer(output.read(), np.float32).astype(float)
    for thing in (lanes, program, buffer, output, frame):
        thing.release()
    return found


_OSL = """
shader probe(string Incident = "", string Outgoing = "", float Eta = 1.0, float Kappa = 0.0,
             output closure color BSDF = 0)
{
    // a pixel of the picture is a pair: the plane spans 0 to 1
    float kappa, variance;
    color wi = texture(Incident, P[0], P[1], "interp", "closest", "alpha", kappa);
    color wo = texture(Outgoing, P[0], P[1], "interp", "closest", "alpha", variance);
    BSDF = emission() * pair_power(vector(wi), vector(wo), md_of(Eta, Kappa), kappa, variance);
}
"""
_CODE = f"""{PLANE}
folder, result = Path(folder), []
shader = compiled(folder / "probe.osl")
for n, k in indices:
    scene, material, script = with_script(shader, "BSDF", side, 1)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    values = [("String", "Incident", str(folder / "incident.exr")),
              ("String", "Outgoing", str(folder / "outgoing.exr")),
              ("Float", "Eta", n), ("Float", "Kappa", k)]
    for kind, name, value in values:
        script.inputs.new("NodeSocket" + kind, name).default_value = value
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0.5, 0.5, 0))
    bpy.ops.object.transform_apply()
    bpy.context.object.data.materials.append(material)
    result.append(seen(scene, folder / "picture.exr", location=(0.5, 0.5, 1))[:, 0].tolist())
"""


def emitted(folder: Path, given: Pairs, model: Model, indices: Sequence[complex]) -> list[Array]:
    """N' of pairs, a square number of them, for each index; pixels of a plane that emits it."""
    side = round(len(given.wi) ** 0.5)
    source = f"{patch_formulas(model)}\n{_OSL}"
    (folder / "probe.osl").write_text(source, encoding="utf-8")
    for name, light, last in (
        ("incident", given.wi, given.kappa), ("outgoing", given.wo, given.variance),
    ):  # fmt: skip
        pixels = np.concatenate([light, last[:, None]], axis=1).astype(np.float32)
        header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
        channels = {"RGBA": np.ascontiguousarray(pixels.reshape(side, side, 4))}
        OpenEXR.File(header, channels).write(str(folder / f"{name}.exr"))
    values = [(index.real, index.imag) for index in indices]
    pictures = result_of(_CODE, folder, folder=str(folder), side=side, indices=values)
    return [np.array(picture) for picture in pictures]
