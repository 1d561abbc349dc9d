"""Time per fragment of the whole fragment stage."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from ...analysis.timing import rounds_of
from .context import Bindings, VertexBuffer
from .packing import pack_responses
from .renderer import Renderer
from .source import LIGHTS
from .texels import Packed

#: Width and height of the timed pictures.
SIDE = 256

_SHORTEST = 0.05  # least duration of a timing, s, by drawing several times
_ROUNDS = 3  # rounds, of which the fastest counts
_EYE = (-0.4, -1.0, 1.6)
_LIGHT = (0.36, 0.48, 0.8, 0.0)


def fragment_times(renderer: Renderer, methods: Sequence[str]) -> dict[str, float]:
    """Return the seconds per fragment of each method.

    The fragments belong to a plane with the first diffracting surface's material, which fills the
    picture under one directional light: all of the fragment stage, with next to no geometry. The
    fastest of some rounds through all methods counts. The clock is `Renderer.clock`.
    """
    surfaces = renderer.scene.surfaces
    number = next(n for n, s in enumerate(surfaces) if s.material.diffraction is not None)
    # a triangle that covers the picture
    corners = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]])
    vertices = np.zeros((3, 17), np.float32)
    vertices[:, :2] = corners
    vertices[:, 3:9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]
    vertices[:, 9:11] = 0.5 * (corners + 1.0)
    vertices[:, 11:] = [0.1, 0.1, 0.1, 1.0, 0.0, 1.0]
    buffer, target = VertexBuffer(renderer.context, vertices), renderer.target(SIDE, SIDE)
    spectra = [(light.wavelengths, light.spectrum) for light in renderer.lights]
    light = Bindings(renderer.context, pack_responses(spectra) | Packed((), {
        "view_projection": tuple(np.eye(4).ravel().tolist()), "eye": _EYE,
        "light_place": np.array([_LIGHT] * LIGHTS, np.float32),
        "light_colour": np.ones((LIGHTS, 3), np.float32),
    }))  # fmt: skip

    def seconds(method: str) -> float:
        """Return the seconds of one picture."""
        parts = light, renderer.bindings[number], renderer.tables(method)[number]
        array = buffer.array(renderer.bound(method, parts))
        target.frame.use()
        renderer.context.enable_only(renderer.context.NOTHING)  # no depth test
        clock, times = renderer.clock, 1
        while True:
            start = clock()
            for _ in range(times):
                array.render()
            renderer.context.finish()
            if (spent := clock() - start) >= _SHORTEST:
                array.release()
                return spent / times
            times = max(2 * times, int(1.2 * times * _SHORTEST / max(spent, 1e-6)))

    calls = {method: functools.partial(seconds, method) for method in methods}
    rounds = rounds_of(calls, _ROUNDS, lambda done, total: None)
    buffer.release()
    target.release()
    return {method: min(times) / SIDE**2 for method, times in rounds.items()}
