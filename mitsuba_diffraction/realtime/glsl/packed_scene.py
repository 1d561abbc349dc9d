"""A scene packed for shaders: one set of numbers and textures for the renderer and for pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...plugin.description import Surface
from .bounces import pack_bounces
from .diffracting import height_room, lobes_of, pack_table
from .emitters import Emitters
from .scene import RealtimeScene, SceneSurface, load, read_scene
from .shader_materials import pack_emission, pack_surface
from .surroundings import flat_shapes, pack_flats, pack_obstacles
from .texels import Packed


@dataclass(frozen=True)
class PackedSurface:
    """A surface as shaders read it, without its table.

    Attributes
    ----------
    scene : triangles and material in the scene.
    packed : numbers, textures and definitions of the material, its energy scales and its light.
    table : number of its table among `PackedScene.diffracting`; None where nothing diffracts.
    """

    scene: SceneSurface
    packed: Packed
    table: int | None


class PackedScene:
    """All that shaders read of a scene; parts that take long are packed at their first use.

    Raises a DiffractionError as `scene.load` and `scene.read_scene` do.

    Parameters
    ----------
    scene : a `mi.Scene` of the current variant, or an XML file.
    sensor : index of the camera.
    octaves : log2 of factors on the height scales for which energy scales are packed, a page each.

    Attributes
    ----------
    diffracting : one surface of each table.
    octaves : those of the parameter whose heights all tables serve.
    """

    def __init__(self, scene: Any, sensor: int = 0, octaves: Sequence[float] = (0.0,)) -> None:
        self.mitsuba_scene = load(scene)
        self.scene: RealtimeScene = read_scene(self.mitsuba_scene, sensor)
        tables: dict[int, Surface] = {}
        for surface in self.scene.diffracting:
            tables.setdefault(id(surface.table), surface)
        self.diffracting = tuple(tables.values())
        numbers = {key: number for number, key in enumerate(tables)}
        room = min(map(height_room, self.scene.diffracting))
        self.octaves = tuple(n for n in octaves if 2.0**n <= max(room, 1.0))
        heights = [2.0**n for n in self.octaves]
        self.surfaces = tuple(
            PackedSurface(
                surface,
                pack_surface(surface.material, heights) | pack_emission(surface.radiance),
                numbers.get(id(surface.table)),
            )
            for surface in self.scene.surfaces
        )
        self._tables: dict[str, list[Packed]] = {}

    def tables(self, method: str) -> list[Packed]:
        """Return the tables packed for a method.

        Raises a DiffractionError if the method is unknown, or does not support a table.
        """
        if method not in self._tables:
            self._tables[method] = [pack_table(one, method) for one in self.diffracting]
        return self._tables[method]

    @cached_property
    def lobes(self) -> list[Packed]:
        """Directions drawn from the lobes of each table, and their densities."""
        return [lobes_of(described) for described in self.diffracting]

    @cached_property
    def emitters(self) -> Emitters | None:
        """All light of the scene, None without emitters."""
        if not self.mitsuba_scene.emitters():
            return None
        return Emitters(self.mitsuba_scene, self.scene.middle)

    @property
    def looks_up(self) -> bool:
        """Whether lobes can look up any direct light."""
        environment = self.emitters is not None and self.emitters.environment is not None
        return environment or any(s.radiance is not None for s in self.scene.surfaces)

    @cached_property
    def around(self) -> Packed:
        """All that lobes look up, for shaders/surroundings.glsl and shaders/obstacles.glsl.

        An environment, flat shapes with their light, and distances to all other shapes without.
        """
        assert self.emitters is not None
        flats = flat_shapes(self.mitsuba_scene)
        extent = float(np.ptp([self.scene.low, self.scene.high]))
        packed = pack_flats(flats, self.emitters.share_of)
        packed |= Packed((), {"least_distance": 1e-6 * extent})
        if (environment := self.emitters.environment) is not None:
            packed |= environment.packed(self.emitters.share_of(environment.emitter))
        flat = {shape.ptr for shape in flats}
        solid: list[NDArray[np.float32]] = [
            surface.vertices[:, :3].reshape(-1, 3, 3)
            for surface in self.scene.surfaces
            if surface.shape.ptr not in flat and surface.radiance is None
        ]
        return packed | pack_obstacles(np.concatenate(solid)) if solid else packed

    @cached_property
    def bounces(self) -> Packed:
        """Light between surfaces, for shaders/bounces.glsl; takes seconds to trace."""
        return pack_bounces(self.mitsuba_scene, self.scene)
