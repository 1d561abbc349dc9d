"""How the patch is turned in the tangent plane: one angle, or a texture of directions (Dr.Jit)."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from .attributes import is_bitmap, require_raw
from .changing import Bounded
from .roles import Callback, Interaction, Mask, Rotation, Texture

#: Degrees; much larger ones leave no digits of the angle in single precision.
MOST_DEGREES = 36_000.0


class Constant:
    """The same angle everywhere, degrees from the first tangent to the patch's x axis."""

    def __init__(self, degrees: float) -> None:
        self._angle = Bounded("orientation", degrees, -MOST_DEGREES, MOST_DEGREES, _refusal)
        self.degrees = self._angle.value
        self.traverse, self.settle = self._angle.traverse, self._angle.settle

    def rotation(self, si: Interaction, active: Mask) -> Rotation:
        """(cos, sin) of the angle."""
        sin, cos = dr.sincos(dr.deg2rad(self.degrees))
        return cos, sin

    def __str__(self) -> str:
        return f"{dr.slice(self.degrees):g}°"


def _refusal(degrees: float) -> str:
    return f"orientation={degrees:g} must be between -{MOST_DEGREES:g} and {MOST_DEGREES:g} degrees"


class Textured:
    """(cos, sin) of the angle in the first two channels of a raw texture or mesh attribute.

    Two channels instead of an angle, so that interpolation has no seam at 360°. They need not be of
    unit length; where both are 0 the patch is not turned.
    """

    def __init__(self, texture: Texture) -> None:
        self.texture = texture
        _check(texture)

    def rotation(self, si: Interaction, active: Mask) -> Rotation:
        """(cos, sin) of the angle at the surface point."""
        value = self.texture.eval_3(si, active)
        length = dr.sqrt(dr.square(value.x) + dr.square(value.y))
        turned = length > 1e-6
        scale = dr.rcp(dr.select(turned, length, 1.0))
        return dr.select(turned, value.x * scale, 1.0), dr.select(turned, value.y * scale, 0.0)

    def traverse(self, callback: Callback) -> None:
        """Expose the texture."""
        callback.put("orientation", self.texture, mi.ParamFlags.Differentiable)

    def settle(self) -> None:
        """The texture looks after itself."""

    def __str__(self) -> str:
        return " ".join(str(self.texture).split())


def _check(texture: Texture) -> None:
    """Refuse a texture whose values are not the directions that somebody saved.

    Raises
    ------
    DiffractionError
        If it has one channel, is taken for colours, or cannot hold negative numbers.
    """
    if not is_bitmap(texture):
        return  # attributes of meshes are checked where there is a mesh
    data = np.array(mi.traverse(texture)["data"])
    if data.shape[-1] < 3:
        raise DiffractionError(
            f"orientation: the bitmap has {data.shape[-1]} channel, but directions take three: "
            "cos, sin, and one that is not read"
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


Orientation = Constant | Textured
