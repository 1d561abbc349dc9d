"""Time per fragment of the whole fragment stage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .context import VertexBuffer, compile_program, set_uniforms
from .renderer import Renderer
from .source import LIGHTS, fragment_parts
from .texels import Uniform

#: Width and height of the timed pictures.
SIDE = 256

_SHORTEST = 0.05  # least duration of a timing, s, by drawing several times
_ROUNDS = 3  # rounds, of which the fastest counts
_EYE = (-0.4, -1.0, 1.6)
_LIGHT = (0.36, 0.48, 0.8, 0.0)


def fragment_times(renderer: Renderer, methods: Sequence[str]) -> dict[str, float]:
    """Return the seconds per fragment of each method.

    The fragments belong to a plane with the first diffracting surface's material, which fills the
    picture under one directional light: all of the fragment stage, with next to no geometry.
    Methods alternate in rounds, and the fastest time of each counts, so that background load
    affects all equally. The clock is `Renderer.clock`.
    """
    timed = {method: _triangle(renderer, method) for method in methods}
    seconds = dict.fromkeys(methods, np.inf)
    for _ in range(_ROUNDS):
        for method, (array, bind, _) in timed.items():
            fragment = _seconds(renderer, array, bind) / SIDE**2
            seconds[method] = min(seconds[method], fragment)
    for _, _, resources in timed.values():
        for resource in resources:
            resource.release()
    return seconds


def _seconds(renderer: Renderer, array: Any, bind: Callable[[], object]) -> float:
    """Return the seconds of one picture; a small picture before it compiles the program."""
    target = renderer.target(SIDE, SIDE)
    target.frame.use()
    renderer.context.enable_only(renderer.context.NOTHING)  # no depth test
    bind()
    target.frame.viewport = (0, 0, 8, 8)
    array.render()
    renderer.context.finish()
    target.frame.viewport = (0, 0, SIDE, SIDE)
    clock = renderer.clock
    times = 1
    while True:
        start = clock()
        for _ in range(times):
            array.render()
        renderer.context.finish()
        seconds = clock() - start
        if seconds >= _SHORTEST:
            target.release()
            return seconds / times
        times = max(2 * times, int(1.2 * times * _SHORTEST / max(seconds, 1e-6)))


def _triangle(renderer: Renderer, method: str) -> tuple[Any, Callable[[], object], tuple[Any, ...]]:
    """Return the vertex array of a triangle that covers the picture with a method's fragments.

    The other results are a function that binds its uniforms, and resources to release.
    """
    surfaces = renderer.scene.surfaces
    number = next(n for n, s in enumerate(surfaces) if s.material.diffraction is not None)
    surface, tables = renderer.bindings[number], renderer.tables(method)[number]
    parts = fragment_parts(method, surface.definitions | tables.definitions)
    program = compile_program(renderer.context, f"method {method}", parts)
    corners = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]])
    vertices = np.zeros((3, 17), np.float32)
    vertices[:, :2] = corners
    vertices[:, 3:9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]
    vertices[:, 9:11] = 0.5 * (corners + 1.0)
    vertices[:, 11:] = [0.1, 0.1, 0.1, 1.0, 0.0, 1.0]
    buffer = VertexBuffer(renderer.context, vertices)
    uniforms: dict[str, Uniform] = {
        "view_projection": tuple(np.eye(4).ravel().tolist()), "eye": _EYE,
        "light_place": np.array([_LIGHT] * LIGHTS, np.float32),
        "light_colour": np.ones((LIGHTS, 3), np.float32),
    }  # fmt: skip

    def bind() -> None:
        set_uniforms(program, uniforms)
        renderer.use_responses(program, tables.use(program, surface.use(program)))

    array = buffer.array(program)
    return array, bind, (array, program, buffer)
