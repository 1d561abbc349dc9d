"""Direct light of all emitters with soft shadows, one light without extent after the other.

See `emitters` for what is drawn and why its mean is right, `shadows` for the shadows. Pixels are
sampled at another place in every frame, so their edges become smooth as the light does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .context import Target, compile_plain, require_moderngl
from .emitters import Emitters
from .lights import Light
from .scene import RealtimeScene
from .shadows import SIZE, Casters, ShadowMap
from .textures import Uniform


class Drawing(Protocol):
    """What of `renderer.Renderer` is used here, which imports this."""

    context: Any
    scene: RealtimeScene
    mitsuba_scene: Any
    buffers: list[Any]

    def target(self, width: int, height: int) -> Target:
        """A framebuffer of floats."""

    def draw_light(
        self, frame: Any, method: str, camera: Camera, light: Light, shadow_map: Any,
        shadows: dict[str, Uniform],
    ) -> None:  # fmt: skip
        """Draw one light, with its shadows."""


class ProgressiveLight:
    """A picture that gets better with every frame: made by `Renderer.progressive`.

    Parameters
    ----------
    renderer, method, camera : what is drawn, how, and from where.
    shadow_size : texels along either side of a shadow map.

    Attributes
    ----------
    frames : how many are in the picture.
    emitters : that are drawn from.
    """

    def __init__(
        self, renderer: Drawing, method: str, camera: Camera, *, shadow_size: int = SIZE
    ) -> None:
        self._renderer, self._method, self._camera = renderer, method, camera
        context, scene = renderer.context, renderer.scene
        self.emitters = Emitters(renderer.mitsuba_scene, scene.middle)
        self._lights = self.emitters.lights()
        self._casters = Casters(context, renderer.buffers, scene.low, scene.high)
        self._places = self._casters.seen(camera)
        self._map = ShadowMap(self._casters, shadow_size)
        width, height = camera.size
        self._frame, self._sum = renderer.target(width, height), renderer.target(width, height)
        self._sum.frame.clear(0.0, 0.0, 0.0, 0.0)
        self._add = compile_plain(context, "whole.vert", "add.frag")
        self._triangle = context.vertex_array(self._add, [])
        self.frames = 0

    def advance(self, frames: int = 1) -> None:
        """Add this many frames, each with one light."""
        for _ in range(frames):
            self._one()

    def _one(self) -> None:
        light = next(self._lights)
        width, height = self._camera.size
        # two sequences that have nothing to do with those of the lights
        inside = (0.5 + self.frames * np.array([0.8191725134, 0.6710436067])) % 1.0 - 0.5
        beside = (0.5 + self.frames * np.array([0.5497004779, 0.2207440846])) % 1.0
        x, y = self._camera.offset
        camera = replace(self._camera, offset=(x + inside[0] / width, y + inside[1] / height))
        self._frame.frame.use()
        self._frame.frame.clear(0.0, 0.0, 0.0, 0.0)
        if len(self._places):
            shadows = self._map.draw(light, self._places, (float(beside[0]), float(beside[1])))
            self._renderer.draw_light(
                self._frame.frame, self._method, camera, light, self._map.texture, shadows
            )
        self._accumulate()
        self.frames += 1

    def _accumulate(self) -> None:
        moderngl = require_moderngl()
        context: Any = self._renderer.context
        self._sum.frame.use()
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.ONE, moderngl.ONE
        self._frame.colour.use(0)
        self._add["frame"].value = 0
        self._triangle.render(moderngl.TRIANGLES, vertices=3)
        context.enable_only(moderngl.NOTHING)

    @property
    def image(self) -> NDArray[np.float32]:
        """The mean so far (height, width, 4): linear sRGB, and the share that is covered."""
        width, height = self._camera.size
        found = np.frombuffer(self._sum.frame.read(components=4, dtype="f4"), np.float32)
        mean = found.reshape(height, width, 4)[::-1] / np.float32(max(self.frames, 1))
        return np.ascontiguousarray(mean, np.float32)

    def release(self) -> None:
        """Free what lies in the graphics card's memory."""
        for thing in (self._triangle, self._add, self._frame, self._sum, self._map, self._casters):
            thing.release()
