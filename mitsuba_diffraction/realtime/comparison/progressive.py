"""Path tracing a few samples at a time, for a window that stays alive meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.camera import Camera
from ..glsl.lights import Light
from .truth import with_lights


class Progressive:
    """Direct light of a scene under these lights, as `truth.with_lights` has it.

    Parameters
    ----------
    scene : `mi.Scene` whose surfaces are seen.
    camera, lights : of the moment.
    spp : samples per pixel in all.
    step : of one pass.
    """

    def __init__(
        self, scene: Any, camera: Camera, lights: Sequence[Light], spp: int = 64, step: int = 8
    ) -> None:
        self._scene = with_lights(scene, camera, lights)
        self.spp, self._step, self.done = spp, step, 0
        self._sum: NDArray[np.float64] = np.zeros((camera.size[1], camera.size[0], 3))

    @property
    def finished(self) -> bool:
        """Whether all samples are taken."""
        return self.done >= self.spp

    def advance(self) -> None:
        """Take the samples of one pass."""
        import mitsuba as mi

        taken = min(self._step, self.spp - self.done)
        image = mi.render(self._scene, spp=taken, seed=self.done)
        self._sum += taken * np.array(image, np.float64)[..., :3]
        self.done += taken

    @property
    def image(self) -> NDArray[np.float32]:
        """The picture so far, (height, width, 3), linear sRGB."""
        return (self._sum / max(self.done, 1)).astype(np.float32)
