"""How long fragments take: whole ones, and a method's look-up alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .context import Bindings, clock_of, compile_program, set_uniforms
from .lights import light_definitions
from .prepared import vertex_array
from .renderer import Renderer
from .source import LIGHTS
from .textures import Packed, Texture

#: Width and height of the pictures that are timed, the same for all methods.
SIDE = 256

_SHORTEST = 0.05  # s that a timing takes, by drawing several times
_ROUNDS = 3  # of which the fastest counts
_EYE = (-0.4, -1.0, 1.6)
_LIGHT = (0.36, 0.48, 0.8, 0.0)


def fragment_times(renderer: Renderer, methods: Sequence[str]) -> dict[str, dict[str, float]]:
    """Seconds a fragment, by method, as "whole" and "look_up".

    Whole are lit fragments of a plane with the first diffracting surface's material, which fills
    the picture under one directional light: all of the fragment stage, with next to no geometry. A
    look-up is the method's own function at as many places, without the surface's shading. All
    methods take turns, and of each the fastest time counts: what else a computer does slows some.
    The clock is that of `context.clock_of`.
    """
    drawn = {
        method: {"whole": _Whole(renderer, method), "look_up": _LookUp(renderer, method)}
        for method in methods
    }
    found = {method: dict.fromkeys(kinds, np.inf) for method, kinds in drawn.items()}
    for _ in range(_ROUNDS):
        for method, kinds in drawn.items():
            for kind, one in kinds.items():
                found[method][kind] = min(found[method][kind], _seconds(renderer, one) / SIDE**2)
    for kinds in drawn.values():
        for one in kinds.values():
            one.release()
    return found


def _seconds(renderer: Renderer, drawn: _Drawn) -> float:
    """Of one picture; the first of the driver's pictures compiles."""
    target = renderer.target(SIDE, SIDE)
    target.frame.use()
    renderer.context.enable_only(_nothing())  # no depth test
    drawn.bind()
    if not drawn.warm:
        target.frame.viewport = (0, 0, 8, 8)
        drawn.draw()
        renderer.context.finish()
        target.frame.viewport = (0, 0, SIDE, SIDE)
        drawn.warm = True
    clock = clock_of(renderer.driver)
    times = 1
    while True:
        start = clock()
        for _ in range(times):
            drawn.draw()
        renderer.context.finish()
        seconds = clock() - start
        if seconds >= _SHORTEST:
            target.release()
            return seconds / times
        times = max(2 * times, int(1.2 * times * _SHORTEST / max(seconds, 1e-6)))


class _Drawn:
    """A program that draws one triangle over the picture."""

    warm = False
    array: Any
    bind: Callable[[], None]
    owned: tuple[Any, ...]

    def draw(self) -> None:
        self.array.render(vertices=3)

    def release(self) -> None:
        for thing in self.owned:
            thing.release()


class _Whole(_Drawn):
    def __init__(self, renderer: Renderer, method: str) -> None:
        number = next(
            n for n, s in enumerate(renderer.scene.surfaces) if s.material.bsdf is not None
        )
        own, tables = renderer.bindings[number], renderer.prepared(method).tables[number]
        definitions = {**own.definitions, **tables.definitions, **light_definitions(1, False)}
        program = compile_program(renderer.context, method, definitions)
        corners = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]])
        vertices = np.zeros((3, 16), np.float32)
        vertices[:, :2] = corners
        vertices[:, 3:9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]
        vertices[:, 9:11] = 0.5 * (corners + 1.0)
        vertices[:, 11:] = [0.1, 0.1, 0.1, 1.0, 0.0]
        buffer = renderer.context.buffer(vertices.tobytes())
        self.array = vertex_array(renderer.context, program, buffer)
        places = np.zeros((LIGHTS, 4), np.float32)
        places[0] = _LIGHT

        def bind() -> None:
            set_uniforms(
                program,
                {
                    "view_projection": tuple(np.eye(4).ravel().tolist()), "eye": _EYE,
                    "view_axis": (0.0, 0.0, 0.0), "light_place": places,
                    "light_colour": np.ones((LIGHTS, 3), np.float32), "height_scale": 1.0,
                },
            )  # fmt: skip
            renderer.use_responses(program, tables.use(program, own.use(program)))

        self.bind = bind
        self.owned = (self.array, program, buffer)


class _LookUp(_Drawn):
    def __init__(self, renderer: Renderer, method: str) -> None:
        number = next(
            n for n, s in enumerate(renderer.scene.surfaces) if s.material.bsdf is not None
        )
        tables = renderer.prepared(method).tables[number]
        program = compile_program(
            renderer.context, method, tables.definitions, vertex="whole.vert", main="probe.frag"
        )
        u, v = np.meshgrid(*2 * [np.linspace(-0.7, 0.7, SIDE)])
        places = np.stack([u, v, 1.8 - 0.5 * u, np.ones_like(u)], axis=-1).astype(np.float32)
        given = Bindings(renderer.context, Packed((Texture("places", places),)))
        self.array = renderer.context.vertex_array(program, [])

        def bind() -> None:
            set_uniforms(program, {"light_colour": np.ones((LIGHTS, 3), np.float32)})
            renderer.use_responses(program, given.use(program, tables.use(program)))

        self.bind = bind
        self.owned = (self.array, program, given)


def _nothing() -> int:
    import moderngl

    return int(moderngl.NOTHING)
