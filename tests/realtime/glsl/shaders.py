"""Shaders' functions called at single places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.realtime.glsl.context import Bindings
from mitsuba_diffraction.realtime.glsl.source import fragment_parts, joined, source_parts
from mitsuba_diffraction.realtime.glsl.texels import (
    Packed,
    Texture,
)

DAYLIGHT = [(np.array([360.0, 830.0]), np.ones(2))]
#: Evaluates a method's function at one set of arguments per fragment.
_PROBE = """#ifdef PAIRED
uniform sampler2D directions;  // ωi in the first row, ωo in the second
#endif
uniform sampler2D places;  // u, v, z = w·height_scale, cosine at the half vector

out vec4 fragment;

void main()
{
#ifdef PAIRED
    ivec2 column = ivec2(gl_FragCoord.x, 0);
    vec3 wi = texelFetch(directions, column, 0).xyz;
    vec3 wo = texelFetch(directions, column + ivec2(0, 1), 0).xyz;
#ifndef ORDERS
    begin_pair(wi, wo, vec2(wi.z, wo.z));
#endif
#endif
    vec4 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0);
#ifdef VALUE
    fragment = VALUE;
#elif defined(ORDERS)
#ifndef PAIRED
    vec3 wi = vec3(0.0, 0.0, 1.0), wo = vec3(place.xy, sqrt(1.0 - dot(place.xy, place.xy)));
#endif
    fragment = vec4(diffraction(wi, wo, vec2(1.0, 0.0), 0), 1.0);
#elif defined(DIFFRACTING)
    fragment = vec4(diffraction(wi, wo, vec2(place.x, 0.0), 0), 1.0);  // stretched
#else
    fragment = vec4(diffracted(place.xy, place.z, place.w, 0), 1.0);
#endif
}
"""
PERFECT = Packed(definitions={"SURFACE_KIND": "0"})


def difference(found: NDArray[Any], exact: NDArray[Any]) -> float:
    """Relative L1 error."""
    return float(np.abs(found - exact).sum() / np.abs(exact).sum())


def probed(gl: Any, method: str, packed: Packed, places: NDArray[Any]) -> NDArray[np.float64]:
    """A method's colours (n, 3) at places (n, 4): u, v, z and the cosine at the half vector.

    A definition VALUE is an expression of GLSL to be evaluated instead.
    """
    picture = np.ascontiguousarray(places[None], np.float32)
    parts = packed | Packed(
        (Texture("places", picture),), {"light_colour": np.ones((4, 3), np.float32)}
    )
    source = joined(fragment_parts(method, parts.definitions)[:-1])
    return drawn(gl, source + _PROBE, parts, (len(places), 1))


def drawn(gl: Any, source: str, parts: Packed, size: tuple[int, int]) -> NDArray[np.float64]:
    """Colours (n, 3) that a fragment shader draws over a picture of this size."""
    vertex = joined(source_parts(["whole.vert"]))
    program = gl.program(vertex_shader=vertex, fragment_shader=source)
    bindings = Bindings(gl, parts)
    target = gl.texture(size, 4, dtype="f4")
    frame = gl.framebuffer([target])
    frame.use()
    bindings.use(program)
    gl.vertex_array(program, []).render(vertices=3)
    result = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:, :3].astype(float)
    for thing in (bindings, frame, target, program):
        thing.release()
    return result


def paired(wi: NDArray[Any], wo: NDArray[Any], **uniforms: Any) -> Packed:
    """Pairs of directions (n, 3) for `probed`."""
    directions = np.pad(np.stack([wi, wo]), [(0, 0)] * 2 + [(0, 1)]).astype("f4")
    return Packed((Texture("directions", directions),), uniforms, {"PAIRED": ""})


def shaded(
    gl: Any, shader: Any, wi: NDArray[Any], wo: NDArray[Any], function: str = "diffraction"
) -> NDArray[np.float64]:
    """f cosθo of pairs under daylight by a function of an exported shader, (n, 3)."""
    columns = 2048
    rows = -(-len(wi) // columns)
    both = np.zeros((2, rows * columns, 4), np.float32)
    both[0, : len(wi), :3], both[1, : len(wi), :3], both[..., 3] = wi, wo, 1.0
    both[:, len(wi) :, 2] = 1.0
    source = f"""#version 330
    {shader.code}
    uniform sampler2D directions;
    out vec4 fragment;
    void main() {{
        ivec2 at = ivec2(gl_FragCoord.xy);
        vec3 wi = texelFetch(directions, at, 0).xyz;
        vec3 wo = texelFetch(directions, at + ivec2(0, {rows}), 0).xyz;
        fragment = vec4({function}(wi, wo), 1.0);
    }}"""
    texture = Texture("directions", both.reshape(2 * rows, columns, 4))
    parts = Packed((*shader.textures, texture), shader.uniforms)
    return drawn(gl, source, parts, (columns, rows))[: len(wi)]
