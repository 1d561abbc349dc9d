"""Orientation of the patch, and checks of textures."""

from __future__ import annotations

from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from .arithmetic import plain
from .description import Quantity
from .parameter_changes import Bounded, Changeable, ObjectValues
from .types import Interaction, Mask, Rotation, Texture

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


#: Degrees; much larger ones leave no digits of the angle in single precision.
MOST_DEGREES = 36_000.0


class Orientation:
    """Angle from the first tangent to the patch's x axis: degrees, or a texture of (cos, sin).

    A raw texture or mesh attribute has (cos, sin) in its first two channels instead of an angle, so
    that interpolation has no seam at 360°. They need not be of unit length; where both are 0 the
    patch is not turned.
    """

    def __init__(self, value: float | Texture) -> None:
        self.texture = value if isinstance(value, mi.Texture) else None
        self.changeable: tuple[Changeable, ...]
        if self.texture is not None:
            _check(self.texture)
            self.changeable = (ObjectValues("orientation", self.texture),)
            return
        angle = Bounded("orientation", value, -MOST_DEGREES, MOST_DEGREES, _refusal)
        self._degrees, self.changeable = angle.value, (angle,)

    def rotation(self, si: Interaction, active: Mask) -> Rotation:
        """Return (cos, sin) of the angle at points of the surface."""
        if self.texture is None:
            sin, cos = dr.sincos(dr.deg2rad(self._degrees))
            return cos, sin
        value = self.texture.eval_3(si, active)
        length = dr.sqrt(dr.square(value.x) + dr.square(value.y))
        turned = length > 1e-6
        scale = dr.rcp(dr.select(turned, length, 1.0))
        return dr.select(turned, value.x * scale, 1.0), dr.select(turned, value.y * scale, 0.0)

    @property
    def quantity(self) -> Quantity:
        """The angle in degrees, or the texture, for descriptions."""
        return Quantity(plain(self._degrees) if self.texture is None else 0.0, self.texture)

    def __str__(self) -> str:
        if self.texture is not None:
            return " ".join(str(self.texture).split())
        return f"{plain(self._degrees):g}°"


def _refusal(degrees: float) -> str:
    return f"orientation={degrees:g} must be between -{MOST_DEGREES:g} and {MOST_DEGREES:g} degrees"


def _check(texture: Texture) -> None:
    """Refuse a texture whose values are not the directions that were saved.

    Raises a DiffractionError if it has one channel, is taken for colours, or cannot hold negative
    numbers.
    """
    if not is_bitmap(texture):
        return  # attributes of meshes are checked where there is a mesh
    data = np.array(mi.traverse(texture)["data"], np.float32)  # half precision would overflow
    if data.shape[-1] < 3:
        raise DiffractionError(
            f"orientation: the bitmap has {data.shape[-1]} channel; an orientation has "
            "three: cosine, sine and an unused one"
        )
    require_raw(texture, "orientation", "(cos, sin)")
    levels, lengths = data[..., :2] * 65535.0, np.hypot(data[..., 0], data[..., 1])
    within = levels.min() >= 0.0 and levels.max() <= 65535.5
    from_integers = within and np.all(np.abs(levels - np.rint(levels)) < 0.02)
    if from_integers and np.any((lengths > 0.0) & (np.abs(lengths - 1.0) > 0.02)):
        raise DiffractionError(
            "orientation: the bitmap comes from a picture of 8 or 16 bits, which cannot hold "
            "negative numbers; save (cos, sin) in a float format, as EXR"
        )
