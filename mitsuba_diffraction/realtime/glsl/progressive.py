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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from .camera import Camera
from .context import Bindings, Resources, ShaderPass, Target, VertexBuffer
from .emitters import NO_LIGHT
from .lights import Lamp
from .packed_scene import PackedScene
from .shadows import SIZE, Casters, ShadowMap
from .texels import Packed, Uniform

# steps of two numbers each for the pixel, the lens, the shadow map and the lobes: fractional parts
# of multiples of square roots of primes are independent (Richtmyer 1951); those of the golden
# ratio, (1 + √5)/2, are the most even, which matters most for lobes
_STEPS = np.append(np.sqrt([2.0, 3.0, 7.0, 11.0, 13.0, 17.0]), [0.5 + 1.25**0.5, 19.0**0.5]) % 1.0

#: Lamp of frames that look up the surroundings: spectra of daylight, to be multiplied by colours.
_WHITE = Lamp("surroundings", np.array([0.0, 0.0, 1.0, 0.0]), np.array([360.0, 830.0]), np.ones(2))


class Stage(Resources):
    """Emitters, surroundings and shadow casters of a scene, uploaded; independent of the camera.

    Raises a DiffractionError if no emitter lights the scene, or the environment is not finite.
    """

    def __init__(self, context: Any, packed: PackedScene, buffers: list[VertexBuffer]) -> None:
        self.context, self._packed = context, packed
        self._bounces: Bindings | None = None
        if packed.emitters is None:
            raise DiffractionError(NO_LIGHT)
        self.emitters = packed.emitters
        self.casters = self.own(Casters(context, packed.scene, buffers))
        self._around = self.own(Bindings(context, packed.around))
        self._lobes = [self.own(Bindings(context, lobes)) for lobes in packed.lobes]
        self._background: ShaderPass | None = None
        if self.emitters.environment is not None:
            files = ("library.glsl", "surroundings.glsl", "background.frag")
            self._background = self.own(ShaderPass(context, *files, **self._around.definitions))
        self.looks_up = packed.looks_up

    def extras(self, bounces: bool) -> list[list[Bindings]]:
        """Return the bindings of each surface: surroundings, lobes, and light between surfaces."""
        shared = [self._around]
        if bounces:
            if self._bounces is None:
                self._bounces = self.own(Bindings(self.context, self._packed.bounces))
            shared.append(self._bounces)
        return [
            shared + ([] if surface.table is None else [self._lobes[surface.table]])
            for surface in self._packed.surfaces
        ]

    def draw_behind(self, frame: Any, camera: Camera, bright: bool) -> None:
        """Clear a framebuffer and, if `bright`, draw the background."""
        frame.use()
        frame.clear(0.0, 0.0, 0.0, 0.0)
        if bright and self._background is not None:
            scene = self._packed.scene
            from_clip = np.linalg.inv(camera.view_projection(scene.low, scene.high))
            uniforms: dict[str, Uniform] = {
                **self._around.uniforms,
                "from_clip": tuple(from_clip.T.ravel().tolist()),
                "eye": tuple(camera.eye.tolist()),
                "picture_size": tuple(float(n) for n in camera.size),
            }
            self._background.draw(uniforms, self._around.textures)


class ProgressiveLight(Resources):
    """Picture that accumulates frames, created by `Renderer.progressive`.

    draw : `Renderer.draw_lights` of a method.
    lights : lights to draw instead of the scene's emitters and surroundings.
    shadow_size : texels a side of a shadow map.
    bounces : whether light between surfaces is added to light from the emitters.
    """

    def __init__(
        self, stage: Stage, draw: Callable[..., None], camera: Camera, *,
        lights: Sequence[Lamp] = (), shadow_size: int = SIZE, bounces: bool = False,
    ) -> None:  # fmt: skip
        self._stage, self._draw, self._camera = stage, draw, camera
        self._fixed = [replace(light, spectrum=len(lights) * light.spectrum) for light in lights]
        bounces = bounces and not lights
        self._looks_up = (stage.looks_up or bounces) and not lights
        self._surroundings = stage.extras(bounces)
        context = stage.context
        self._map = self.own(ShadowMap(stage.casters, shadow_size))
        # a frame, and the sum of each kind of frames
        self._frame, *self._sums = (self.own(Target(context, *camera.size)) for _ in range(3))
        self._visible = stage.casters.visible(camera)
        self.restart()
        self._add = self.own(ShaderPass(context, "add.frag"))

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
        emitters = self._stage.emitters
        self._lights: Iterator[Lamp] = (
            itertools.cycle(self._fixed) if self._fixed else emitters.lights()
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
            self._stage.draw_behind(self._frame.frame, camera, bright=kind == 1)
            if kind == 0:
                self._light(light, camera, numbers[4:6])
            else:
                self._look_up(camera, numbers[6:8])
            self._sums[kind].frame.use()
            blended: dict[str, Uniform] = {"first": True, "covers": 1.0}
            self._add.draw(blended, {"frame": self._frame.colour}, adding=True)
            self._counts[kind] += 1

    def _light(self, light: Lamp, camera: Camera, shift: Real) -> None:
        """Draw one light with its shadows."""
        uniforms = self._map.draw(light, self._visible, (float(shift[0]), float(shift[1])))
        uniforms["light_density"] = light.density
        definitions = {"SHADOWED": "", "PIGMENT_IN_LIGHT": ""}
        if self._looks_up:
            definitions["WEIGHTED"] = ""
        self._draw_part(
            light, camera, Packed((), uniforms, definitions), shadow_map=self._map.texture
        )

    def _look_up(self, camera: Camera, numbers: Real) -> None:
        """Draw the surroundings that each pixel's lobes look up."""
        uniforms = {"sequence": tuple(numbers.tolist()), "surroundings_lit": (1.0, 1.0)}
        self._draw_part(_WHITE, camera, Packed((), uniforms, {"LOOKED_UP": ""}))

    def _draw_part(self, light: Lamp, camera: Camera, packed: Packed, **textures: Any) -> None:
        """Draw one kind of a frame."""
        bindings = Bindings(self._stage.context, packed)
        bindings.textures |= textures
        self._draw(
            self._frame.frame, camera, [light], bindings, self._surroundings, self._visible.windings
        )

    @property
    def image(self) -> NDArray[np.float32]:
        """Picture so far (height, width, 4): linear sRGB, and the coverage of each pixel."""
        sums = zip(self._sums, self._counts, strict=True)
        total = np.sum([target.read() / np.float32(max(count, 1)) for target, count in sums], 0)
        total[..., 3] /= np.float32(max(sum(count > 0 for count in self._counts), 1))
        return np.asarray(total, np.float32)
