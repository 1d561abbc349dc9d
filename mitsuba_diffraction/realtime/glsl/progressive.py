"""Direct light of all emitters with soft shadows, one light without extent after the other.

Frames are of two kinds in turn. One draws a light with its shadows: see `emitters` for what is
drawn and why its mean is right, `shadows` for the shadows. The other looks up what each pixel's
lobes meet (`surroundings`), and shows what is behind the scene and what emits light. The balance
heuristic shares the light between them. Pixels and the lens are sampled at another place in every
frame, so their edges become smooth as the light does.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...tables.store import cached_colours
from .camera import Camera
from .context import Bindings, Target, compile_plain, require_moderngl, set_uniforms
from .emitters import Emitters
from .lights import Light, light_definitions
from .materials import coat_index, height_scale
from .methods import vertex_array
from .scene import RealtimeScene
from .shadows import SIZE, Casters, ShadowMap
from .surroundings import flat_shapes, pack_flats, pack_lobes, pack_obstacles
from .texels import Packed, Uniform

Array = NDArray[np.float64]

# two numbers each for the pixel, the lens, the shadow map and the lobes: multiples of the roots of
# primes less their whole parts have nothing to do with each other (Richtmyer 1951); those of the
# golden ratio, (1 + √5)/2, are the most even, and lobes need that most
_STEPS = np.append(np.sqrt([2.0, 3.0, 7.0, 11.0, 13.0, 17.0]), [0.5 + 1.25**0.5, 19.0**0.5]) % 1.0

#: Towards what the second kind of frame looks: all spectra are daylight's, the colours come later.
_WHITE = Light("surroundings", np.array([0.0, 0.0, 1.0, 0.0]), np.array([360.0, 830.0]), np.ones(2))


class Drawing(Protocol):
    """What of `renderer.Renderer` is used here, which imports this."""

    context: Any
    scene: RealtimeScene
    mitsuba_scene: Any
    buffers: list[Any]

    def target(self, width: int, height: int) -> Target:
        """A framebuffer of floats."""

    @property
    def draw_lights(self) -> Callable[..., None]:
        """Draw some lights, or what the surroundings send."""


class Stage:
    """What does not depend on the camera: emitters, surroundings, what casts shadows.

    Raises a DiffractionError if no emitter brings light, or the environment is not finite.
    """

    def __init__(self, renderer: Drawing) -> None:
        self._context, self._scene = renderer.context, renderer.scene
        self._owned: list[Any] = []
        self.emitters = Emitters(renderer.mitsuba_scene, self._scene.middle)
        self._add_glowing(renderer.buffers)
        flats = flat_shapes(renderer.mitsuba_scene)
        around = [
            self._bound(pack_surroundings(self._scene, self.emitters, flats)),
            self._bound(pack_solid(self._scene, flats)),
        ]
        self._around = around[0]
        self._background, self._triangle = None, None
        if self.emitters.environment is not None:
            self._background = self._kept(
                compile_plain(
                    self._context, "whole.vert", "background.frag",
                    ("library.glsl", "surroundings.glsl"), self._around.definitions,
                )
            )  # fmt: skip
            self._triangle = self._kept(self._context.vertex_array(self._background, []))
        self.extras = self._with_lobes(around)  # of each surface, what its shader reads of it
        # whether there is anything to look up along lobes
        self.looks_up = self._scene.glows or self._background is not None

    def _kept(self, thing: Any) -> Any:
        self._owned.append(thing)
        return thing

    def _bound(self, packed: Packed) -> Bindings:
        bindings: Bindings = self._kept(Bindings(self._context, packed))
        return bindings

    def _add_glowing(self, buffers: list[Any]) -> None:
        """What emits light: to be seen, and to stand in the way."""
        context, scene = self._context, self._scene
        self._glow = self._kept(compile_plain(context, "surface.vert", "glow.frag"))
        vertices = [self._kept(context.buffer(one.vertices.tobytes())) for one in scene.emitting]
        self._glowing = [self._kept(vertex_array(context, self._glow, v)) for v in vertices]
        self._radiances = [tuple(float(x) for x in one.radiance) for one in scene.emitting]
        self.casters = self._kept(Casters(context, scene.surfaces, buffers, vertices))

    def _with_lobes(self, around: list[Bindings]) -> list[Joined]:
        """Of each surface, what surrounds it and where it sends light."""
        lobes: dict[int, Bindings] = {}
        found = []
        for surface in self._scene.surfaces:
            own = []
            if surface.material.bsdf is not None:
                table = surface.material.table
                if id(table) not in lobes:
                    factor = height_scale(surface.material) * coat_index(surface.material)
                    lobes[id(table)] = self._bound(pack_lobes(cached_colours(table), factor))
                own.append(lobes[id(table)])
            found.append(Joined([*around, *own]))
        return found

    def draw_behind(self, frame: Any, camera: Camera, bright: bool) -> None:
        """The background and what emits light into a framebuffer; dark, it only covers."""
        moderngl = require_moderngl()
        matrix = camera.view_projection(self._scene.low, self._scene.high)
        frame.use()
        frame.clear(0.0, 0.0, 0.0, 0.0)
        if bright and self._background is not None and self._triangle is not None:
            self._context.enable_only(moderngl.NOTHING)
            self._around.use(self._background)
            behind: dict[str, Uniform] = {
                "from_clip": tuple(np.linalg.inv(matrix).T.ravel().tolist()),
                "eye": tuple(camera.eye.tolist()),
                "picture_size": tuple(float(n) for n in camera.size),
            }
            set_uniforms(self._background, behind)
            self._triangle.render(moderngl.TRIANGLES, vertices=3)
        self._context.enable_only(moderngl.DEPTH_TEST)
        shared: dict[str, Uniform] = {
            "view_projection": tuple(matrix.T.ravel().tolist()), "eye": tuple(camera.eye.tolist())
        }  # fmt: skip
        set_uniforms(self._glow, shared)
        for array, radiance in zip(self._glowing, self._radiances, strict=True):
            set_uniforms(self._glow, {"radiance": radiance if bright else (0.0, 0.0, 0.0)})
            array.render(moderngl.TRIANGLES)

    def release(self) -> None:
        for thing in reversed(self._owned):
            thing.release()


def pack_surroundings(scene: RealtimeScene, emitters: Emitters, flats: Sequence[Any]) -> Packed:
    """The environment, and shapes that directions meet exactly, for shaders/surroundings.glsl."""
    extent = float(np.ptp([scene.low, scene.high]))
    packed = pack_flats(flats, emitters.share_of)
    packed |= Packed((), {"least_distance": 1e-6 * extent})
    environment = emitters.environment
    if environment is not None:
        packed |= environment.packed(emitters.share_of(environment.emitter))
    return packed


def pack_solid(scene: RealtimeScene, flats: Sequence[Any]) -> Packed:
    """All else that stands in a direction's way, for shaders/obstacles.glsl."""
    exact = {shape.ptr for shape in flats}
    solid = [
        surface.vertices[:, :3].reshape(-1, 3, 3)
        for surface in scene.surfaces
        if surface.shape.ptr not in exact and surface.radiance is None
    ]
    return pack_obstacles(np.concatenate(solid)) if solid else Packed()


class Joined:
    """Several bindings as one."""

    def __init__(self, parts: list[Bindings]) -> None:
        self._parts = parts
        self.definitions = {k: v for part in parts for k, v in part.definitions.items()}

    def use(self, program: Any, first_unit: int = 0) -> int:
        """As of `Bindings`."""
        for part in self._parts:
            first_unit = part.use(program, first_unit)
        return first_unit


class ProgressiveLight:
    """A picture that gets better with every frame: made by `Renderer.progressive`.

    lights : these alone, instead of the scene's emitters and what surrounds it.
    shadow_size : texels along either side of a shadow map.
    """

    def __init__(
        self, renderer: Drawing, method: str, camera: Camera, stage: Stage, *,
        lights: Sequence[Light] = (), shadow_size: int = SIZE,
    ) -> None:  # fmt: skip
        self._renderer, self._method, self._camera = renderer, method, camera
        self._stage = stage
        self._fixed = [replace(one, spectrum=len(lights) * one.spectrum) for one in lights]
        self._looks_up = stage.looks_up and not lights
        self._surface: dict[str, float | None] = {}
        context = renderer.context
        self._map = ShadowMap(stage.casters, shadow_size)
        width, height = camera.size
        self._frame = renderer.target(width, height)
        self._sums = [renderer.target(width, height) for _ in range(2)]  # of either kind of frame
        self._counts = [0, 0]
        self._lights: Iterator[Light] = iter(())
        self.restart(camera)
        self._add = compile_plain(context, "whole.vert", "add.frag")
        self._triangle = context.vertex_array(self._add, [])
        self._mean = compile_plain(context, "whole.vert", "mean.frag", ("library.glsl",))
        self._whole = context.vertex_array(self._mean, [])

    @property
    def frames(self) -> int:
        """How many are in the picture."""
        return sum(self._counts)

    def restart(self, camera: Camera | None = None, **surface: float | None) -> None:
        """Start again, with another camera of the same size or other surfaces.

        surface : height scale and coherence width as of `Renderer.draw`.
        """
        if camera is not None:
            self._camera, self._surface = camera, surface
            self._seen = self._stage.casters.seen(camera)
        for target in self._sums:
            target.frame.clear(0.0, 0.0, 0.0, 0.0)
        self._counts = [0, 0]
        self._drawn: Counter[tuple[str, bool]] = Counter()  # frames of each
        emitters = self._stage.emitters
        self._lights = itertools.cycle(self._fixed) if self._fixed else emitters.lights()

    def advance(self, frames: int = 1) -> None:
        """Add this many frames."""
        for _ in range(frames):
            kind = self.frames % 2 if self._looks_up else 0
            light = next(self._lights) if kind == 0 else _WHITE
            # each emitter has all places in turn, a sky and its sun too: else glints come by chance
            drawn = light.name, light.density != 0.0
            self._drawn[drawn] += 1
            places = (0.5 + self._drawn[drawn] * _STEPS) % 1.0
            camera = self._camera.sampled(places[:2] - 0.5, places[2:4])
            self._stage.draw_behind(self._frame.frame, camera, bright=kind == 1)
            if kind == 0:
                self._light(light, camera, places[4:6])
            else:
                self._look_up(camera, places[6:8])
            self._accumulate(self._sums[kind])
            self._counts[kind] += 1

    def _light(self, light: Light, camera: Camera, beside: Array) -> None:
        """One light with its shadows."""
        if not len(self._seen.places):
            return
        uniforms, each = self._map.draw(light, self._seen, (float(beside[0]), float(beside[1])))
        uniforms["light_density"] = light.density
        definitions = light_definitions(1, False) | {"SHADOWED": "", "PIGMENT_IN_LIGHT": ""}
        if self._looks_up:
            definitions["WEIGHTED"] = ""
        self._renderer.draw_lights(
            self._frame.frame, self._method, camera, [light], definitions, uniforms,
            self._extras(each), **self._surface,
        )  # fmt: skip

    def _look_up(self, camera: Camera, numbers: Array) -> None:
        """What each pixel's lobes meet."""
        self._renderer.draw_lights(
            self._frame.frame, self._method, camera, [_WHITE],
            light_definitions(1, False) | {"LOOKED_UP": ""},
            {"sequence": tuple(numbers.tolist())}, self._extras(), **self._surface,
        )  # fmt: skip

    def _extras(self, in_map: Sequence[dict[str, Uniform]] = ()) -> list[Extra]:
        """Of each surface; in_map : what it is in the shadow map, if one was drawn."""
        bodies: list[dict[str, Uniform]] = [{"solid": solid} for solid in self._seen.solid]
        texture = self._map.texture if in_map else None
        return [
            Extra(extra, {**body, **own}, texture)
            for extra, body, own in zip(
                self._stage.extras, bodies, in_map or [{}] * len(bodies), strict=True
            )
        ]

    def _accumulate(self, target: Target) -> None:
        moderngl = require_moderngl()
        context: Any = self._renderer.context
        target.frame.use()
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.ONE, moderngl.ONE
        self._frame.colour.use(0)
        self._add["frame"].value = 0
        self._triangle.render(moderngl.TRIANGLES, vertices=3)
        context.enable_only(moderngl.NOTHING)

    def show(self, frame: Any, exposure: float) -> None:
        """The picture so far into a framebuffer of the same size, exposed, as sRGB."""
        moderngl = require_moderngl()
        context: Any = self._renderer.context
        frame.use()
        context.enable_only(moderngl.NOTHING)
        for unit, target in enumerate(self._sums):
            target.colour.use(unit)
        weights = tuple(1.0 / max(count, 1) for count in self._counts)
        shown: dict[str, Uniform] = {
            "first": 0, "second": 1, "weights": weights, "exposure": exposure
        }  # fmt: skip
        set_uniforms(self._mean, shown)
        self._whole.render(moderngl.TRIANGLES, vertices=3)

    @property
    def image(self) -> NDArray[np.float32]:
        """The picture so far (height, width, 4): linear sRGB, and the share that is covered."""
        width, height = self._camera.size
        total = np.zeros((height, width, 4), np.float32)
        for target, count in zip(self._sums, self._counts, strict=True):
            found = np.frombuffer(target.frame.read(components=4, dtype="f4"), np.float32)
            mean = found.reshape(height, width, 4)[::-1] / np.float32(max(count, 1))
            total += mean
        total[..., 3] /= np.float32(max(sum(count > 0 for count in self._counts), 1))
        return total

    def release(self) -> None:
        made = (self._triangle, self._add, self._whole, self._mean)
        for thing in (*made, self._frame, *self._sums, self._map):
            thing.release()


class Extra:
    """A surface's extras, what it is in this frame, and the light's shadow map, if there is one."""

    def __init__(self, extra: Joined, own: dict[str, Uniform], shadow_map: Any) -> None:
        self._extra, self._own, self._map = extra, own, shadow_map
        self.definitions = extra.definitions

    def use(self, program: Any, first_unit: int = 0) -> int:
        """As of `Bindings`."""
        first_unit = self._extra.use(program, first_unit)
        set_uniforms(program, self._own)
        sampler = program.get("shadow_map", None)
        if self._map is not None and sampler is not None:
            self._map.use(first_unit)
            sampler.value = first_unit
            first_unit += 1
        return first_unit
