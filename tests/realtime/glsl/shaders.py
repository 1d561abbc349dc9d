"""Shaders' functions called at single places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.realtime.glsl.context import Bindings
from mitsuba_diffraction.realtime.glsl.source import fragment_parts, vertex_source
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
    source = "".join(text for _, text in fragment_parts(method, parts.definitions)[:-1])
    vertex = vertex_source(name="whole.vert")
    program = gl.program(vertex_shader=vertex, fragment_shader=source + _PROBE)
    bindings = Bindings(gl, parts)
    target = gl.texture((len(places), 1), 4, dtype="f4")
    frame = gl.framebuffer([target])
    frame.use()
    bindings.use(program)
    gl.vertex_array(program, []).render(vertices=3)
    result = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:, :3].astype(float)
    for thing in (bindings, frame, target, program):
        thing.release()
    return result


def shaded(gl: Any, shader: Any, wi: NDArray[Any], wo: NDArray[Any]) -> NDArray[np.float64]:
    """f cosθo of pairs under daylight by an exported shader, (n, 3)."""
    columns = 2048
    rows = -(-len(wi) // columns)
    both = np.zeros((2, rows * columns, 4), np.float32)
    both[0, : len(wi), :3], both[1, : len(wi), :3], both[..., 3] = wi, wo, 1.0
    both[:, len(wi) :, 2] = 1.0
    main = f"""
    uniform sampler2D directions;
    out vec4 fragment;
    void main() {{
        ivec2 at = ivec2(gl_FragCoord.xy);
        vec3 wi = texelFetch(directions, at, 0).xyz;
        vec3 wo = texelFetch(directions, at + ivec2(0, {rows}), 0).xyz;
        fragment = vec4(diffraction(wi, wo), 1.0);
    }}"""
    vertex = (
        "#version 330\nvoid main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, "
        "gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }"
    )
    program = gl.program(
        vertex_shader=vertex, fragment_shader=f"#version 330\n{shader.code}\n{main}"
    )
    texture = Texture("directions", both.reshape(2 * rows, columns, 4))
    bound = Bindings(gl, Packed((*shader.textures, texture), shader.uniforms))
    target = gl.texture((columns, rows), 4, dtype="f4")
    frame = gl.framebuffer([target])
    frame.use()
    bound.use(program)
    gl.vertex_array(program, []).render(vertices=3)
    drawn = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[: len(wi), :3]
    return drawn.astype(float)
