"""What surrounds a page's scene: an environment, shapes that emit light, and what lobes meet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...tables.store import cached_colours
from ..glsl.emitters import Emitters
from ..glsl.lobes import pack_lobes
from ..glsl.materials import Material, coat_index, height_scale
from ..glsl.scene import RealtimeScene
from ..glsl.source import plain_source, vertex_source
from ..glsl.stage import pack_solid, pack_surroundings
from ..glsl.surroundings import flat_shapes
from ..glsl.texels import Packed, shortened
from .geometry import packed_mesh, sections_of
from .parts import packed_parts
from .sections import Sections


def packed_surroundings(
    mitsuba_scene: Any,
    scene: RealtimeScene,
    emitters: Emitters | None,
    materials: Sequence[Material],
    sections: Sections,
) -> tuple[dict[str, Any] | None, dict[str, str]]:
    """All that the page knows of it, and what its shaders must know when they are compiled.

    materials : one for each table, which lobes are drawn by.

    Returns
    -------
    JSON, None where there is neither; definitions.
    """
    environment = None if emitters is None else emitters.environment
    if emitters is None or not (scene.glows or environment):
        return None, {}
    flats = flat_shapes(mitsuba_scene)
    packed, solid = pack_surroundings(scene, emitters, flats), pack_solid(scene, flats)
    lobes = [_lobes(material) for material in materials]
    definitions = {k: v for part in (packed, solid, *lobes) for k, v in part.definitions.items()}
    background = None
    if environment is not None:
        shared = ("library.glsl", "surroundings.glsl")
        background = plain_source("background.frag", shared, packed.definitions, "web")
    return {
        "parts": packed_parts(packed | solid, sections),
        "lobes": [packed_parts(one, sections) for one in lobes],
        "emitting": [
            {"mesh": sections_of(packed_mesh(one.vertices), sections.add),
             "radiance": one.radiance.tolist()}
            for one in scene.emitting
        ],
        "glow": plain_source("glow.frag", dialect="web"),
        "background": background,
        "whole": vertex_source("web", "whole.vert"),
    }, definitions  # fmt: skip


def _lobes(material: Material) -> Packed:
    """In fewer digits: whatever they are, densities are those that directions are drawn with."""
    factor = height_scale(material) * coat_index(material)
    packed = pack_lobes(cached_colours(material.table), factor)
    fewer: dict[str, Callable[[Any], Any]] = {
        "lobe_places": np.float16,
        "lobe_densities": shortened,
    }
    textures = [replace(t, data=fewer[t.name](t.data)) for t in packed.textures]
    return replace(packed, textures=tuple(textures))
