"""How the patch is turned in the tangent plane: one angle, or a texture of directions (Dr.Jit)."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from .roles import Callback, Interaction, Mask, Rotation, Texture


class Constant:
    """The same angle everywhere, degrees from the first tangent to the patch's x axis."""

    def __init__(self, degrees: float) -> None:
        self.degrees = mi.Float(degrees)

    def rotation(self, si: Interaction, active: Mask) -> Rotation:
        """(cos, sin) of the angle."""
        sin, cos = dr.sincos(dr.deg2rad(self.degrees))
        return cos, sin

    def traverse(self, callback: Callback) -> None:
        """Expose the angle."""
        callback.put("orientation", self.degrees, mi.ParamFlags.Differentiable)

    def update(self) -> None:
        """Keep the angle a variable, so that a new value needs no new kernel."""
        dr.make_opaque(self.degrees)

    def __str__(self) -> str:
        return f"{dr.slice(self.degrees):g}°"


class Textured:
    """(cos, sin) of the angle in the first two channels of a raw texture or mesh attribute.

    Two channels instead of an angle, so that interpolation has no seam at 360°. They need not be of
    unit length; where both are 0 the patch is not turned.
    """

    def __init__(self, texture: Texture) -> None:
        self.texture = texture

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

    def update(self) -> None:
        """The texture looks after itself."""

    def __str__(self) -> str:
        return " ".join(str(self.texture).split())


Orientation = Constant | Textured
