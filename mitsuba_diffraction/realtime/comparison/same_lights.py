"""A scene by shaders and by path tracing, under the lights that both of them know."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ..glsl.renderer import Renderer
from ..glsl.scene import load
from .measures import regions
from .truth import seen, with_lights


class SameLights:
    """A scene for both renderers: direct light of directions and points alone.

    Lights with an extent are replaced by points and directions in both: the sun of a sky by its
    direction. The rest of the sky is left out of both.

    Parameters
    ----------
    scene : a `mi.Scene` of the variant that is set, or an XML file.
    sensor : index of the camera.
    name : what errors call the scene.

    Attributes
    ----------
    renderer : draws it by shaders.
    scene : for the path tracer; its one sensor averages evenly over each pixel.

    Raises
    ------
    DiffractionError
        If the scene has no light with a direction or place, or as of `glsl.Renderer`.
    """

    def __init__(self, scene: Any, *, sensor: int = 0, name: str = "the scene") -> None:
        scene = load(scene)
        self.renderer = Renderer(scene, sensor=sensor)
        if not self.renderer.lights:
            raise DiffractionError(
                f"{name} has no light with a direction or place to compare under; add a "
                "directional or point emitter, or a sky with a sun"
            )
        self.renderer.sky = np.zeros((4, 3))
        self.scene = with_lights(scene, self.renderer.camera, self.renderer.lights)
        self._sees = seen(self.scene, self.renderer.lights)
        known = {surface.shape.ptr: surface for surface in self.renderer.scene.surfaces}
        found = [known.get(shape.ptr) for shape in self.scene.shapes()]
        self._exact = np.array([s is not None and s.exact for s in found])
        self._diffracting = np.array([s is not None and s.material.bsdf is not None for s in found])

    def regions(self, drawn: NDArray[np.floating]) -> dict[str, NDArray[np.bool_]]:
        """Kinds of pixels (height, width) of a picture by `renderer`, see `measures.regions`."""
        return regions(self._sees, self._exact, self._diffracting, drawn[..., 3])
