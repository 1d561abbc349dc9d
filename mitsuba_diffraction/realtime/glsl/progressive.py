"""Direct light of all emitters with soft shadows, accumulated over frames.

Two kinds of frames alternate. The first draws one light with its shadows (`emitters`, `shadows`).
The second looks up the surroundings along each pixel's lobes (`surroundings`), and draws the
background and emitted light. The balance heuristic weights the two. Every frame samples
another point of each pixel and of the lens, so that edges become smooth with the light. On request,
frames of the second kind add light that surfaces send to each other (`bounces`).
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from .camera import Camera
from .context import Resources, ShaderPass, Target
from .emitters import NO_LIGHT
from .lights import Lamp
from .shadows import ShadowMap
from .texels import Packed, Uniform

if TYPE_CHECKING:
    from .renderer import Renderer

# steps of two numbers each for the pixel, the lens, the shadow map and the lobes: fractional parts
# of multiples of square roots of primes are independent (Richtmyer 1951); those of the golden
# ratio, (1 + √5)/2, are the most even, which matters most for lobes
_STEPS = np.append(np.sqrt([2.0, 3.0, 7.0, 11.0, 13.0, 17.0]), [0.5 + 1.25**0.5, 19.0**0.5]) % 1.0

#: Lamp of frames that look up the surroundings: spectra of daylight, to be multiplied by colours.
_WHITE = Lamp("surroundings", np.array([0.0, 0.0, 1.0, 0.0]), np.array([360.0, 830.0]), np.ones(2))


class ProgressiveLight(Resources):
    """Picture that accumulates frames, created by `Renderer.progressive`.

    lights : lights to draw instead of the scene's emitters and surroundings.
    shadow_size : texels a side of a shadow map.
    bounces : whether light between surfaces is added to light from the emitters.

    Raises a DiffractionError if no emitter lights the scene, or the environment is not finite.
    """

    def __init__(
        self, renderer: Renderer, method: str, camera: Camera, lights: Sequence[Lamp],
        shadow_size: int, bounces: bool,
    ) -> None:  # fmt: skip
        self._renderer, self._method, self._camera = renderer, method, camera
        packed, context = renderer.packed, renderer.context
        if packed.emitters is None:
            raise DiffractionError(NO_LIGHT)
        self._emitters = packed.emitters
        self._fixed = [replace(light, spectrum=len(lights) * light.spectrum) for light in lights]
        bounces = bounces and not lights
        self._looks_up = (packed.looks_up or bounces) and not lights
        self._around = [renderer.around, *([renderer.bounces] if bounces else [])]
        self._map = self.own(
            ShadowMap(context, packed.scene, renderer.buffers, camera, shadow_size)
        )
        # a frame, and the sum of each kind of frames
        self._frame, *self._sums = (self.own(Target(context, *camera.size)) for _ in range(3))
        self.restart()
        self._add = self.own(ShaderPass(context, "add.frag"))
        self._background: ShaderPass | None = None
        if self._emitters.environment is not None:
            files = ("library.glsl", "surroundings.glsl", "background.frag")
            shown = ShaderPass(context, *files, **renderer.around.definitions)
            self._background = self.own(shown)

    @property
    def frames(self) -> int:
        """Number of frames in the picture."""
        return sum(self._counts)

    def restart(self) -> None:
        """Start again."""
        for target in self._sums:
            target.frame.clear(0.0, 0.0, 0.0, 0.0)
        self._counts = [0, 0]
        self._drawn: Counter[tuple[str, bool]] = Counter()  # number of frames of each emitter
        self._lights: Iterator[Lamp] = (
            itertools.cycle(self._fixed) if self._fixed else self._emitters.lights()
        )

    def advance(self, frames: int = 1) -> None:
        """Add this many frames."""
        for _ in range(frames):
            kind = self.frames % 2 if self._looks_up else 0
            light = next(self._lights) if kind == 0 else _WHITE
            # one sequence per emitter, for a sky and its sun, too: random points would cause glints
            emitter = light.name, light.density != 0.0
            self._drawn[emitter] += 1
            numbers = (0.5 + self._drawn[emitter] * _STEPS) % 1.0
            camera = self._camera.sampled(numbers[:2] - 0.5, numbers[2:4])
            self._draw_behind(camera, bright=kind == 1)
            if kind == 0:
                marks = ("PIGMENT_IN_LIGHT", *(["WEIGHTED"] if self._looks_up else []))
                packed = Packed((), {"light_density": light.density}, dict.fromkeys(marks, ""))
                shared = [self._map.draw(light, numbers[4:6]), *self._around]
            else:
                drawn = {"sequence": tuple(numbers[6:8].tolist()), "surroundings_lit": (1.0, 1.0)}
                packed, shared = Packed((), drawn, {"LOOKED_UP": ""}), self._around
            frame = self._frame.frame
            self._renderer.draw_lights(self._method, frame, camera, [light], packed, shared)
            self._sums[kind].frame.use()
            blended: dict[str, Uniform] = {"first": True, "covers": 1.0}
            self._add.draw(blended, {"frame": self._frame.colour}, adding=True)
            self._counts[kind] += 1

    def _draw_behind(self, camera: Camera, bright: bool) -> None:
        """Clear the frame and, if `bright`, draw the background."""
        self._frame.frame.use()
        self._frame.frame.clear(0.0, 0.0, 0.0, 0.0)
        if bright and self._background is not None:
            scene, around = self._renderer.scene, self._renderer.around
            from_clip = np.linalg.inv(camera.view_projection(scene.low, scene.high))
            uniforms: dict[str, Uniform] = {
                **around.uniforms,
                "from_clip": tuple(from_clip.T.ravel().tolist()),
                "eye": tuple(camera.eye.tolist()),
                "picture_size": tuple(float(n) for n in camera.size),
            }
            self._background.draw(uniforms, around.textures)

    @property
    def image(self) -> NDArray[np.float32]:
        """Picture so far (height, width, 4): linear sRGB, and the coverage of each pixel."""
        sums = zip(self._sums, self._counts, strict=True)
        total = np.sum([target.read() / np.float32(max(count, 1)) for target, count in sums], 0)
        total[..., 3] /= np.float32(max(sum(count > 0 for count in self._counts), 1))
        return np.asarray(total, np.float32)
