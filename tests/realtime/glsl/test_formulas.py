"""Formulas of optics in GLSL, one by one, against `md.reference` in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.optics.boundary import MODELS, Model
from mitsuba_diffraction.realtime.glsl.formulas import formulas
from tests.support.formulas import (
    COAT,
    FADED,
    INDICES,
    Pairs,
    check,
    exact_faded,
    exact_power,
    pairs,
)

PAIRS = pairs(4000)

VERTEX = """#version 330
const float PI = 3.14159265358979;
float arcsine(float x) {{ return asin(x); }}
{functions}
in vec3 wi; in vec3 wo; in vec2 heights; out float result;
void main()
{{
    {body}
    float one = 0.5 * dot(a + b, a + b);
    result = one * one * boundary_factor({late}heights.x, heights.y);
}}
"""


def shaded(gl: Any, given: Pairs, model: Model, index: complex, coated: bool) -> NDArray[Any]:
    """N' of pairs by the functions that the renderer's shaders have."""
    real = index.imag == 0.0
    n = COAT if coated else 1.0
    relative = index / n
    text = f"{relative.real:.9g}" if real else f"vec2({relative.real:.9g}, {relative.imag:.9g})"
    definitions = {"BOUNDARY": model.name, "SURFACE_KIND": "1" if real else "2"}
    early = "a, b" + (f", {text}" if real else "")
    body = "vec3 a = wi, b = wo;\n"
    if coated:
        definitions["COATED"] = ""
        body = f"vec3 a = refracted(wi, {n}), b = refracted(wo, {n});\n"
        early += f", {n}, wi.z, wo.z"
    body += f"    begin_boundary({early});"
    source = VERTEX.format(
        functions=formulas(definitions), body=body, late="" if real else f"{text}, "
    )
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


@pytest.mark.parametrize("coated", [False, True], ids=["bare", "coated"])
@pytest.mark.parametrize("kind", INDICES)
def test_boundary_is_that_of_the_reference(gl: Any, kind: str, coated: bool) -> None:
    index = INDICES[kind]
    found = shaded(gl, PAIRS, MODELS["small_slope"], index, coated)
    check(found, exact_power(PAIRS, index, coated=coated))


@pytest.mark.parametrize("kind", ["dielectric", "metal"])
def test_own_model_of_the_heights(gl: Any, monkeypatch: Any, kind: str) -> None:
    monkeypatch.setitem(MODELS, FADED.name, FADED)
    found = shaded(gl, PAIRS, FADED, INDICES[kind], coated=False)
    check(found, exact_faded(PAIRS, INDICES[kind]))


def test_model_that_branches_on_values_is_refused(monkeypatch: Any) -> None:
    def branching(geometry: Any, index: Any, heights: Any) -> Any:
        return boundary.kirchhoff(geometry, index if heights.kappa > 1.0 else 1.0 * index)

    monkeypatch.setitem(MODELS, "branching", Model("branching", branching))
    with pytest.raises(DiffractionError, match=r"test_formulas.py, line \d+.*branches on a value"):
        formulas({"BOUNDARY": "branching", "SURFACE_KIND": "1"})
