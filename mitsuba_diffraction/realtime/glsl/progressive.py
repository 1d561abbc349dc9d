"""Direct light of all emitters with soft shadows, accumulated over frames.

Two kinds of frames alternate. The first draws one light with its shadows (`emitters`, `shadows`).
The second looks up the surroundings along each pixel's lobes (`surroundings`), and draws the
background and shapes that emit light. The balance heuristic weights the two. Every frame samples
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

from .bounces import pack_bounces
from .camera import Camera
from .context import Bindings, ShaderPass, Target, compile_plain, set_uniforms
from .emitters import Emitters
from .lights import Lamp
from .methods import vertex_array
from .scene import RealtimeScene
from .shadows import SIZE, Casters, ShadowMap
from .surroundings import flat_shapes, pack_flats, pack_obstacles
from .texels import Packed, Uniform

Array = NDArray[np.float64]

# steps of two numbers each for the pixel, the lens, the shadow map and the lobes: fractional parts
# of multiples of square roots of primes are independent (Richtmyer 1951); those of the golden
# ratio, (1 + √5)/2, are the most even, which matters most for lobes
_STEPS = np.append(np.sqrt([2.0, 3.0, 7.0, 11.0, 13.0, 17.0]), [0.5 + 1.25**0.5, 19.0**0.5]) % 1.0

#: Lamp of frames that look up the surroundings: spectra of daylight, to be multiplied by colours.
_WHITE = Lamp("surroundings", np.array([0.0, 0.0, 1.0, 0.0]), np.array([360.0, 830.0]), np.ones(2))


class Stage:
    """Emitters, surroundings and shadow casters of a scene, independent of the camera.

    Raises a DiffractionError if no emitter lights the scene, or the environment is not finite.
    """

    def __init__(
        self, context: Any, mitsuba_scene: Any, scene: RealtimeScene, buffers: list[Any]
    ) -> None:
        self.context, self._scene, self._mitsuba_scene = context, scene, mitsuba_scene
        self._with_bounces: list[list[Bindings]] | None = None
        self._resources: list[Any] = []
        self.emitters = Emitters(mitsuba_scene, scene.middle)
        self._add_glowing(buffers)
        flats = flat_shapes(mitsuba_scene)
        self._around = self._bound(pack_surroundings(scene, self.emitters, flats))
        self._background: ShaderPass | None = None
        if self.emitters.environment is not None:
            shared = ("library.glsl", "surroundings.glsl")
            self._background = self._register(
                ShaderPass(context, "background.frag", shared, self._around.definitions)
            )
        # bindings of each surface
        self.extras = self._with_lobes([self._around, self._bound(pack_solid(scene, flats))])
        # whether lobes can look up any light
        self.looks_up = self._scene.glows or self._background is not None

    def _register(self, resource: Any) -> Any:
        """Add a resource that `release` frees, and return it."""
        self._resources.append(resource)
        return resource

    def _bound(self, packed: Packed) -> Bindings:
        """Upload packed data."""
        bindings: Bindings = self._register(Bindings(self.context, packed))
        return bindings

    def _add_glowing(self, buffers: list[Any]) -> None:
        """Add shapes that emit light, both as pictures and as shadow casters."""
        context, scene = self.context, self._scene
        self._glow = self._register(compile_plain(context, "surface.vert", "glow.frag"))
        vertices = [self._register(context.buffer(g.vertices.tobytes())) for g in scene.emitting]
        self._glowing = [self._register(vertex_array(context, self._glow, v)) for v in vertices]
        self.casters = self._register(Casters(context, scene.surfaces, buffers, vertices))

    def _with_lobes(self, around: list[Bindings]) -> list[list[Bindings]]:
        """Return the bindings of each surface: the surroundings, and its lobes if it diffracts."""
        lobes: dict[int, Bindings] = {}
        extras = []
        for surface in self._scene.surfaces:
            parts = [*around]
            if (diffraction := surface.material.diffraction) is not None:
                key = id(diffraction.described.table)
                if key not in lobes:
                    lobes[key] = self._bound(diffraction.lobes())
                parts.append(lobes[key])
            extras.append(parts)
        return extras

    def with_bounces(self) -> list[list[Bindings]]:
        """Return `extras` with the light between surfaces, traced at the first call."""
        if self._with_bounces is None:
            traced = self._bound(pack_bounces(self._mitsuba_scene, self._scene))
            self._with_bounces = [[*extra, traced] for extra in self.extras]
        return self._with_bounces

    def draw_behind(self, frame: Any, camera: Camera, bright: bool) -> None:
        """Clear a framebuffer and draw background and emitters; unless `bright`, in black."""
        matrix = camera.view_projection(self._scene.low, self._scene.high)
        frame.use()
        frame.clear(0.0, 0.0, 0.0, 0.0)
        shared: dict[str, Uniform] = {
            "view_projection": tuple(matrix.T.ravel().tolist()),
            "from_clip": tuple(np.linalg.inv(matrix).T.ravel().tolist()),
            "eye": tuple(camera.eye.tolist()),
            "picture_size": tuple(float(n) for n in camera.size),
        }
        if bright and self._background is not None:
            self._background.draw(self._around.uniforms | shared, self._around.textures)
        self.context.enable_only(self.context.DEPTH_TEST)
        set_uniforms(self._glow, shared)
        for array, glow in zip(self._glowing, self._scene.emitting, strict=True):
            set_uniforms(self._glow, {"radiance": tuple((bright * glow.radiance).tolist())})
            array.render()

    def release(self) -> None:
        for resource in reversed(self._resources):
            resource.release()


def pack_surroundings(scene: RealtimeScene, emitters: Emitters, flats: Sequence[Any]) -> Packed:
    """Pack the environment and flat shapes for shaders/surroundings.glsl."""
    extent = float(np.ptp([scene.low, scene.high]))
    packed = pack_flats(flats, emitters.share_of)
    packed |= Packed((), {"least_distance": 1e-6 * extent, "surroundings_lit": (1.0, 1.0)})
    environment = emitters.environment
    if environment is not None:
        packed |= environment.packed(emitters.share_of(environment.emitter))
    return packed


def pack_solid(scene: RealtimeScene, flats: Sequence[Any]) -> Packed:
    """Pack all other shapes that obstruct directions, for shaders/obstacles.glsl."""
    exact = {shape.ptr for shape in flats}
    solid = [
        surface.vertices[:, :3].reshape(-1, 3, 3)
        for surface in scene.surfaces
        if surface.shape.ptr not in exact and surface.radiance is None
    ]
    return pack_obstacles(np.concatenate(solid)) if solid else Packed()


class ProgressiveLight:
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
        self._surroundings = stage.with_bounces() if bounces else stage.extras
        context = stage.context
        self._map = ShadowMap(stage.casters, shadow_size)
        self._frame = Target(context, *camera.size)
        self._sums = [Target(context, *camera.size) for _ in range(2)]  # one per kind of frame
        self._counts = [0, 0]
        self._lights: Iterator[Lamp] = iter(())
        self.restart(camera)
        self._add = ShaderPass(context, "add.frag")

    @property
    def frames(self) -> int:
        """Number of frames in the picture."""
        return sum(self._counts)

    def restart(self, camera: Camera | None = None) -> None:
        """Start again, with another camera of the same size."""
        if camera is not None:
            self._camera = camera
            self._visible = self._stage.casters.visible(camera)
        for target in self._sums:
            target.frame.clear(0.0, 0.0, 0.0, 0.0)
        self._counts = [0, 0]
        self._drawn: Counter[tuple[str, bool]] = Counter()  # number of frames of each emitter
        emitters = self._stage.emitters
        self._lights = itertools.cycle(self._fixed) if self._fixed else emitters.lights()

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
            self._add.draw({}, {"frame": self._frame.colour}, adding=True)
            self._counts[kind] += 1

    def _light(self, light: Lamp, camera: Camera, shift: Array) -> None:
        """Draw one light with its shadows."""
        if not len(self._visible.places):
            return
        uniforms = self._map.draw(light, self._visible, (float(shift[0]), float(shift[1])))
        uniforms["light_density"] = light.density
        definitions = {"SHADOWED": "", "PIGMENT_IN_LIGHT": ""}
        if self._looks_up:
            definitions["WEIGHTED"] = ""
        textures = {"shadow_map": self._map.texture}
        self._draw_surfaces(light, camera, definitions, uniforms, textures)

    def _look_up(self, camera: Camera, numbers: Array) -> None:
        """Draw the surroundings that each pixel's lobes look up."""
        uniforms: dict[str, Uniform] = {"sequence": tuple(numbers.tolist())}
        self._draw_surfaces(_WHITE, camera, {"LOOKED_UP": ""}, uniforms, {})

    def _draw_surfaces(
        self, light: Lamp, camera: Camera, definitions: dict[str, str],
        uniforms: dict[str, Uniform], textures: dict[str, Any],
    ) -> None:  # fmt: skip
        """Draw all surfaces with the definitions, uniforms and textures of a kind of frame."""
        self._draw(
            self._frame.frame, camera, [light], definitions, uniforms,
            self._surroundings, textures,
        )  # fmt: skip

    @property
    def image(self) -> NDArray[np.float32]:
        """Picture so far (height, width, 4): linear sRGB, and the coverage of each pixel."""
        sums = zip(self._sums, self._counts, strict=True)
        total = np.sum([target.read() / np.float32(max(count, 1)) for target, count in sums], 0)
        total[..., 3] /= np.float32(max(sum(count > 0 for count in self._counts), 1))
        return np.asarray(total, np.float32)

    def release(self) -> None:
        resources: list[Any] = [self._add, self._frame, *self._sums, self._map]
        for resource in resources:
            resource.release()
