"""A factor on the heights that varies over the surface: worn and fresh places (Dr.Jit)."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from .attributes import is_bitmap, require_raw
from .memory import index_between
from .roles import Callback, Float, Interaction, Mask, Texture

#: Flatter would be lost in single precision.
LEAST_SCALE = 1e-30


class Varying:
    """A texture's or mesh attribute's number at each point, from 0 to `high`.

    Parameters
    ----------
    texture : of one channel; a bitmap is raw.
    most : the largest factor, which mesh attributes and procedural textures must be given; None
        for a bitmap's own.

    Attributes
    ----------
    high : the largest factor; what is larger is taken for it.
    """

    def __init__(self, texture: Texture, most: float | None) -> None:
        self.texture, self._is_bitmap = texture, is_bitmap(texture)
        if not self._is_bitmap and most is None:
            raise DiffractionError(
                "height_scale of a texture that is no bitmap, or of a mesh attribute, needs "
                "height_scale_max, the largest factor that it has"
            )
        require_raw(texture, "height_scale", "factors")
        self.high = self.range()[1] if most is None else most
        if not 0.0 < self.high <= 1e3:  # also refuses NaN
            given = "its largest factor" if most is None else "height_scale_max"
            raise DiffractionError(
                f"height_scale: {given}, {self.high:g}, must be above 0 and at most 1000"
            )
        if refused := self.settle():
            raise DiffractionError(refused)

    def range(self) -> tuple[float, float]:
        """The least and the largest factor there are, as far as is known."""
        if not self._is_bitmap:
            return 0.0, self.high
        values = np.array(mi.traverse(self.texture)["data"], float)
        return float(values.min()), float(values.max())

    def at(self, si: Interaction, active: Mask) -> Float:
        """The factor at points of the surface."""
        return index_between(self.texture.eval_1(si, active), LEAST_SCALE, self.high)

    def settle(self) -> str | None:
        """See `Bounded.settle`."""
        low, high = self.range()
        if low >= 0.0 and high <= self.high * (1.0 + 1e-6):
            return None
        return (
            f"height_scale: the bitmap's factors go from {low:g} to {high:g}; they must be between "
            f"0 and {self.high:g}"
        )

    def traverse(self, callback: Callback) -> None:
        """Expose the texture."""
        callback.put("height_scale", self.texture, mi.ParamFlags.Differentiable)

    def __str__(self) -> str:
        return " ".join(str(self.texture).split())
