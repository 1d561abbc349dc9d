"""Shaders' functions called at single places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.realtime.glsl.context import (
    Bindings,
    compile_program,
)
from mitsuba_diffraction.realtime.glsl.texels import (
    Packed,
    Texture,
)

DAYLIGHT = [(np.array([360.0, 830.0]), np.ones(2))]
PERFECT = Packed(definitions={"SURFACE_KIND": "0"})


def difference(found: NDArray[Any], exact: NDArray[Any]) -> float:
    """Relative L1 error."""
    return float(np.abs(found - exact).sum() / np.abs(exact).sum())


def probed(gl: Any, method: str, packed: Packed, places: NDArray[Any]) -> NDArray[np.float64]:
    """A method's colours (n, 3) at places (n, 4): u, v, z and the cosine at the half vector."""
    picture = np.ascontiguousarray(places[None], np.float32)
    parts = packed | Packed(
        (Texture("places", picture),), {"light_colour": np.ones((4, 3), np.float32)}
    )
    program = compile_program(gl, method, parts.definitions, vertex="whole.vert", main="probe.frag")
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
