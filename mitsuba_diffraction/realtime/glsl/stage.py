"""What progressive light needs of a scene from wherever it is seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from ...tables.store import cached_colours
from .camera import Camera
from .casters import Casters
from .context import Bindings, Target, compile_plain, require_moderngl, set_uniforms
from .emitters import Emitters
from .lights import Light
from .lobes import pack_lobes
from .materials import coat_index, height_scale
from .obstacles import pack_obstacles
from .prepared import vertex_array
from .scene import RealtimeScene
from .surroundings import flat_shapes, pack_flats
from .texels import Packed, Uniform


class Drawing(Protocol):
    """What of `renderer.Renderer` is used here, which imports this."""

    context: Any
    scene: RealtimeScene
    mitsuba_scene: Any
    buffers: list[Any]

    def target(self, width: int, height: int) -> Target:
        """A framebuffer of floats."""

    def draw_light(
        self, frame: Any, method: str, camera: Camera, light: Light, definitions: dict[str, str],
        uniforms: dict[str, Uniform], extras: Any, **surface: float | None,
    ) -> None:  # fmt: skip
        """Draw one light, or what the surroundings send."""


class Stage:
    """What does not depend on the camera: emitters, surroundings, what casts shadows.

    Parameters
    ----------
    renderer : whose scene it is.

    Attributes
    ----------
    emitters : that lights are drawn from.
    casters : what casts shadows.
    extras : of each surface, what its shader reads of the surroundings.
    looks_up : whether there is anything to look up along lobes.

    Raises
    ------
    DiffractionError
        If no emitter brings light, or the environment is not finite.
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
        self.extras = self._with_lobes(around)
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
        """Free what lies in the graphics card's memory."""
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
