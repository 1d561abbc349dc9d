"""Checks of textures."""

from __future__ import annotations

from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from .types import Interaction, Texture

#: Points a side of the unit square of UV coordinates at which procedural textures are checked.
_POINTS = 32


def is_bitmap(texture: Texture) -> bool:
    """Whether a texture is a bitmap, whose values can be read."""
    return str(texture.class_name()).startswith("BitmapTexture")


def is_attribute(texture: Texture) -> bool:
    """Whether a texture is a mesh attribute, which has values on that mesh only."""
    return str(texture.class_name()) == "MeshAttribute"


def range_of(texture: Texture) -> tuple[float, float] | None:
    """Return the least and the largest number of a texture; None for mesh attributes.

    Procedural textures are asked at points of the unit square of UV coordinates.
    """
    if is_attribute(texture):
        return None
    if is_bitmap(texture):
        numbers = np.array(mi.traverse(texture)["data"], float)
    else:
        numbers = np.concatenate([np.ravel(texture.eval_1(si, True)) for si in uv_square()])
    return float(numbers.min()), float(numbers.max())


def uv_square() -> Iterator[Interaction]:
    """Yield hits at points of the unit square of UV coordinates, singly in scalar variants."""
    places = (np.indices((_POINTS, _POINTS)).reshape(2, -1).astype(np.float32) + 0.5) / _POINTS
    for part in [places] if dr.is_jit_v(mi.Float) else places.T.tolist():
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv = mi.Point2f(part)
        yield si


def require_raw(texture: Texture, parameter: str, meaning: str) -> None:
    """Refuse a picture whose numbers Mitsuba would take for colours.

    Raises a DiffractionError with the remedy.
    """
    if is_bitmap(texture) and "raw = 1" not in str(texture):
        raise DiffractionError(
            f"{parameter}: the bitmap is not raw, so that Mitsuba takes {meaning} for colours; "
            'add <boolean name="raw" value="true"/> to the texture ("raw": True in Python)'
        )
