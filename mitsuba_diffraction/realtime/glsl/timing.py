"""Time per fragment of whole shaders, and of a method's look-up alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .context import Bindings, clock_of, compile_program, set_uniforms
from .methods import vertex_array
from .renderer import Renderer
from .source import LIGHTS
from .texels import Packed, Texture, Uniform

#: Width and height of the timed pictures.
SIDE = 256

_SHORTEST = 0.05  # least duration of a timing, s, by drawing several times
_ROUNDS = 3  # rounds, of which the fastest counts
_EYE = (-0.4, -1.0, 1.6)
_LIGHT = (0.36, 0.48, 0.8, 0.0)


def fragment_times(renderer: Renderer, methods: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return the seconds per fragment of each method, as "whole" and "look_up".

    Whole fragments belong to a plane with the first diffracting surface's material, which fills
    the picture under one directional light: all of the fragment stage, with next to no geometry. A
    look-up is only the method's function at as many points, without the surface's shading. Methods
    alternate in rounds, and the fastest time of each counts, so that background load affects all
    equally. The clock is `context.clock_of`.
    """
    timed = {
        (method, kind): prepare(renderer, method)
        for method in methods
        for kind, prepare in (("whole", _whole), ("look_up", _look_up))
    }
    seconds = {method: {"whole": np.inf, "look_up": np.inf} for method in methods}
    for _ in range(_ROUNDS):
        for (method, kind), triangle in timed.items():
            fragment = _seconds(renderer, triangle) / SIDE**2
            seconds[method][kind] = min(seconds[method][kind], fragment)
    for _, _, resources in timed.values():
        for resource in resources:
            resource.release()
    return seconds


#: Vertex array of a triangle that covers the picture, setter of uniforms, resources to release.
_Triangle = tuple[Any, Callable[[], object], tuple[Any, ...]]


def _seconds(renderer: Renderer, triangle: _Triangle) -> float:
    """Return the seconds of one picture; a small picture before it compiles the program."""
    array, bind, _ = triangle
    target = renderer.target(SIDE, SIDE)
    target.frame.use()
    renderer.context.enable_only(renderer.context.NOTHING)  # no depth test
    bind()
    target.frame.viewport = (0, 0, 8, 8)
    array.render(vertices=3)
    renderer.context.finish()
    target.frame.viewport = (0, 0, SIDE, SIDE)
    clock = clock_of(renderer.driver)
    times = 1
    while True:
        start = clock()
        for _ in range(times):
            array.render(vertices=3)
        renderer.context.finish()
        seconds = clock() - start
        if seconds >= _SHORTEST:
            target.release()
            return seconds / times
        times = max(2 * times, int(1.2 * times * _SHORTEST / max(seconds, 1e-6)))


def _first_diffracting(renderer: Renderer, method: str) -> tuple[Bindings, Bindings]:
    """Return the bindings of the first diffracting surface, and of the method's tables."""
    surfaces = renderer.scene.surfaces
    number = next(n for n, s in enumerate(surfaces) if s.material.diffraction is not None)
    return renderer.bindings[number], renderer.prepared(method).tables[number]


def _whole(renderer: Renderer, method: str) -> _Triangle:
    """Prepare a triangle with the whole fragment stage of a method."""
    surface, tables = _first_diffracting(renderer, method)
    definitions = surface.definitions | tables.definitions
    program = compile_program(renderer.context, method, definitions)
    corners = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]])
    vertices = np.zeros((3, 17), np.float32)
    vertices[:, :2] = corners
    vertices[:, 3:9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]
    vertices[:, 9:11] = 0.5 * (corners + 1.0)
    vertices[:, 11:] = [0.1, 0.1, 0.1, 1.0, 0.0, 1.0]
    buffer = renderer.context.buffer(vertices.tobytes())
    uniforms: dict[str, Uniform] = {
        "view_projection": tuple(np.eye(4).ravel().tolist()), "eye": _EYE,
        "view_axis": (0.0, 0.0, 0.0), "light_place": np.array([_LIGHT] * LIGHTS, np.float32),
        "light_colour": np.ones((LIGHTS, 3), np.float32), "height_scale": 1.0,
    }  # fmt: skip

    def bind() -> None:
        set_uniforms(program, uniforms)
        renderer.use_responses(program, tables.use(program, surface.use(program)))

    array = vertex_array(renderer.context, program, buffer)
    return array, bind, (array, program, buffer)


def _look_up(renderer: Renderer, method: str) -> _Triangle:
    """Prepare a triangle with the look-up of a method alone."""
    tables = _first_diffracting(renderer, method)[1]
    program = compile_program(
        renderer.context, method, tables.definitions, vertex="whole.vert", main="probe.frag"
    )
    u, v = np.meshgrid(*2 * [np.linspace(-0.7, 0.7, SIDE)])
    places = np.stack([u, v, 1.8 - 0.5 * u, np.ones_like(u)], axis=-1).astype(np.float32)
    points = Bindings(renderer.context, Packed((Texture("places", places),)))

    def bind() -> None:
        set_uniforms(program, {"light_colour": np.ones((LIGHTS, 3), np.float32)})
        renderer.use_responses(program, points.use(program, tables.use(program)))

    array = renderer.context.vertex_array(program, [])
    return array, bind, (array, program, points)
