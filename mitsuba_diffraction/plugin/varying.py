"""Numbers over a surface: one number between bounds, or a texture or mesh attribute (Dr.Jit).

Heights, lengths, weights, depths and the orientation of the patch are of this kind.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from .arithmetic import plain
from .description import Quantity
from .memory import index_between
from .parameter_changes import Changeable
from .properties import number
from .textures import is_bitmap, range_of, require_raw
from .types import Float, Interaction, Mask, Properties, Rotation, Texture

#: Least number that stands for one above 0: less would be lost in single precision.
LEAST_SCALE = 1e-30


class Varying(Changeable):
    """Parameter that is a number, or a texture's or mesh attribute's number at each point.

    Parameters
    ----------
    name : of the parameter.
    value : number or raw texture of one channel.
    low, high : bounds; a texture's numbers are clamped to them.
    positive : whether the number must be above 0, where `low` is; a texture's 0 is a tiny number.
    unit, meaning : of the number, for messages; advice : end of the message on a number out of
        bounds.

    Attributes
    ----------
    texture : the texture, or None.

    Raises a DiffractionError if a number, or a texture's known range, is out of bounds.
    """

    def __init__(
        self,
        name: str,
        value: float | Texture,
        low: float,
        high: float,
        *,
        positive: bool = False,
        unit: str = "",
        meaning: str = "",
        advice: str = "",
    ) -> None:
        self.low, self.high = low, high
        self._unit, self._meaning, self._advice = unit, meaning, advice
        self._least = LEAST_SCALE if positive and low == 0.0 else low
        self.texture = value if isinstance(value, mi.Texture) else None
        if self.texture is not None:
            require_raw(self.texture, name, "numbers")
        # to single precision, as bounds are
        super().__init__(name, self.texture or mi.Float(float(np.float32(value))))
        if refused := self.refusal():
            raise DiffractionError(refused)

    def at(self, si: Interaction, active: Mask) -> Float:
        """Return the number at points of the surface."""
        if self.texture is None:
            return self.value
        return index_between(self.texture.eval_1(si, active), self._least, self.high)

    @property
    def number(self) -> float:
        """The number, or the upper bound of a texture's numbers."""
        return self.high if self.texture is not None else plain(dr.max(self.value))

    def range(self) -> tuple[float, float]:
        """Return the smallest and the largest number, as far as known."""
        if self.texture is None:
            return self.number, self.number
        known = range_of(self.texture) if is_bitmap(self.texture) else None
        return known or (self.low, self.high)

    @property
    def differentiable(self) -> bool:
        """Whether derivatives with respect to the number are wanted."""
        return self.texture is None and dr.grad_enabled(self.value)

    @property
    def quantity(self) -> Quantity:
        """The number, for descriptions."""
        return Quantity(self.number, self.texture)

    def refusal(self) -> str | None:
        """See `Changeable.refusal`."""
        if self.texture is not None:
            return self._range_refusal(self.texture) or super().refusal()
        numbers = np.array(dr.detach(self.value), float).ravel()
        low, high = np.float32(self._least), np.float32(self.high)
        wrong = numbers[~((numbers >= low) & (numbers <= high))]
        if not len(wrong):
            return None
        least = "above 0" if self._least > self.low else f"at least {self.low:g}{self._unit}"
        return (
            f"{self.name}={wrong[0]:g}{self._unit}{self._meaning} must be {least} and at most "
            f"{self.high:g}{self._unit}{self._advice}"
        )

    def _range_refusal(self, texture: Texture) -> str | None:
        """Reason why the range of a texture's numbers is not allowed, or None."""
        if (known := range_of(texture)) is None:
            return None
        # to single precision; procedural textures are clipped, as the documentation says
        high = known[1] if is_bitmap(texture) else min(known[1], self.high)
        if self.low <= known[0] and high <= self.high * (1.0 + 1e-6):
            return None
        return (
            f"{self.name}: the texture's numbers go from {known[0]:g} to {known[1]:g}{self._unit}; "
            f"they must be between {self.low:g} and {self.high:g}{self._unit}"
        )

    def __str__(self) -> str:
        if self.texture is None:
            return f"{self.number:g}{self._unit}"
        return " ".join(str(self.texture).split())


#: Largest factor on heights.
MOST_SCALE = 1e3
#: Bounds of factors on lengths: beyond, the coherence window covers no period, or all of a scan.
LEAST_STRETCH, MOST_STRETCH = 0.01, 100.0


def largest_of(props: Properties, name: str, least: float, most: float) -> tuple[Any, float]:
    """Return a scene's factor, a number or a texture, 1 by default, and its largest value.

    The largest value of a texture is the parameter `…_max` or that of a bitmap; that of a number is
    the number itself.

    Raises a DiffractionError with the parameter, its value and the allowed values.
    """
    value: Any = dict(props.objects()).get(name)
    largest = number(props, f"{name}_max", 1.0) if f"{name}_max" in props else None
    if not isinstance(value, mi.Texture):
        value = number(props, name, 1.0)
        described, found = f"{name}={value:g}", value
    elif is_bitmap(value) and largest is None:
        known = range_of(value)
        assert known is not None
        described, found = f"{name}: its largest factor, {known[1]:g},", known[1]
    elif largest is None:
        raise DiffractionError(
            f"{name} of a texture other than a bitmap, or of a mesh attribute, needs {name}_max, "
            "the largest factor that it has"
        )
    else:
        described, found = f"{name}_max={largest:g}", largest
    if not least <= found <= most:  # also refuses NaN
        low = "above 0" if least == LEAST_SCALE else f"at least {least:g}"
        raise DiffractionError(f"{described} must be {low} and at most {most:g}")
    return value, found


class LateralScale(Varying):
    """Factor by which the patch is stretched in its plane; 1 where a scene gives none.

    Attributes
    ----------
    of_table : factor by which the table's heights are stretched: the largest, or 1 where none is
        above 1, so that no look-up goes beyond the table's frequencies.
    given : whether a scene gives the factor, which may change then.
    """

    def __init__(self, props: Properties) -> None:
        name, largest_name = "lateral_scale", "lateral_scale_max"
        value, largest = largest_of(props, name, LEAST_STRETCH, MOST_STRETCH)
        if largest_name in props and not isinstance(value, mi.Texture):
            if name not in props:
                raise DiffractionError(f"{largest_name} is for a {name}; give both, or none")
            largest = number(props, largest_name, 1.0)
            if not value <= largest <= MOST_STRETCH:
                raise DiffractionError(
                    f"{largest_name}={largest:g} must be at least {name}, {value:g}, and at most "
                    f"{MOST_STRETCH:g}"
                )
        self.of_table = max(1.0, largest)
        high = largest if isinstance(value, mi.Texture) else self.of_table
        advice = ", the table's range; load the plugin anew with that lateral_scale_max"
        super().__init__(name, value, LEAST_STRETCH, high, advice=advice)
        self.given = name in props

    def over_table(self, si: Interaction, active: Mask) -> Float:
        """Return the factor relative to the table's.

        The plain number 1 without lateral_scale: kernels have no operation for it.
        """
        return self.at(si, active) * (1.0 / self.of_table) if self.given else 1.0

    def range_over_table(self) -> tuple[float, float]:
        """Return the least and the largest factor relative to the table's, as far as known."""
        low, high = self.range()
        return low / self.of_table, high / self.of_table

    @property
    def quantity(self) -> Quantity:
        """The factor relative to the table's, for descriptions."""
        return Quantity(self.range_over_table()[1], self.texture)


#: Degrees; much larger ones leave no digits of the angle in single precision.
MOST_DEGREES = 36_000.0


#: Largest error of an angle in degrees, where (cos, sin) are stored in integers of 8 or 16 bits.
PRECISION = {bits: np.degrees(np.sqrt(2.0) / (2**bits - 1)) for bits in (8, 16)}
# Directions shorter than this turn nothing: 128 of 255 is not quite 0.
_SHORTEST = 0.02
# Share of a bitmap's directions that must have unit length, or none, to tell how it stores them
_MOST = 0.9


class Orientation(Varying):
    """Angle from the first tangent to the patch's x axis: degrees, or a texture of (cos, sin).

    A raw texture or mesh attribute has (cos, sin) in its first two channels instead of an angle, so
    that interpolation has no seam at 360°. Pictures of 8 and 16 bits, which hold no negative
    numbers, have (1 + cos)/2 and (1 + sin)/2, as normal maps do. Directions need not be of unit
    length; where both are 0 the patch is not turned.

    Raises a DiffractionError if a bitmap has one channel, is taken for colours, or holds directions
    in neither way.
    """

    def __init__(self, value: float | Texture) -> None:
        super().__init__("orientation", value, -MOST_DEGREES, MOST_DEGREES, unit="°")
        bitmap = self.texture is not None and is_bitmap(self.texture)
        self._doubled = bitmap and _doubled(self.texture)

    def rotation(self, si: Interaction, active: Mask) -> Rotation:
        """Return (cos, sin) of the angle at points of the surface."""
        if self.texture is None:
            sin, cos = dr.sincos(dr.deg2rad(self.at(si, active)))
            return cos, sin
        value, shortest = self.texture.eval_3(si, active), 1e-6
        if self._doubled:
            value, shortest = 2.0 * value - 1.0, _SHORTEST
        length = dr.sqrt(dr.square(value.x) + dr.square(value.y))
        turned = length > shortest
        scale = dr.rcp(dr.select(turned, length, 1.0))
        return dr.select(turned, value.x * scale, 1.0), dr.select(turned, value.y * scale, 0.0)

    @property
    def quantity(self) -> Quantity:
        """The angle in degrees, or the texture, for descriptions."""
        return Quantity(self.number if self.texture is None else 0.0, self.texture)

    def _range_refusal(self, texture: Texture) -> None:
        """See `Varying._range_refusal`: directions are checked once, or where there is a mesh."""

    def __str__(self) -> str:
        if not self._doubled:
            return super().__str__()
        return (
            f"{super().__str__()} of (1 + cos)/2, (1 + sin)/2, within {PRECISION[8]:.2g}° in 8 "
            f"bits and {PRECISION[16]:.2g}° in 16"
        )


def _doubled(bitmap: Texture) -> bool:
    """Whether a bitmap holds (1 + cos)/2 and (1 + sin)/2; refuse one without directions."""
    data = np.array(mi.traverse(bitmap)["data"], np.float32)
    if (channels := data.shape[-1]) < 3:
        raise DiffractionError(
            f"orientation: the bitmap has {channels} channel; an orientation has "
            "three: cosine, sine and an unused one"
        )
    levels = 65535.0 * (data := data[..., :2])  # float32: half would overflow
    integers = levels.min() >= 0.0 and levels.max() <= 65535.5
    integers = integers and np.all(np.abs(levels - np.rint(levels)) < 0.02)
    doubled = bool(integers and _unit_share(data) <= _MOST)
    if doubled and _unit_share(2.0 * data - 1.0) <= _MOST:
        raise DiffractionError(
            "orientation: the bitmap comes from a picture of 8 or 16 bits, which holds no "
            "negative numbers: save (1 + cos)/2 and (1 + sin)/2 there, or (cos, sin) in a "
            "float format, as EXR"
        )
    return doubled


def _unit_share(directions: np.ndarray[Any, Any]) -> float:
    """Return the share of directions (…, 2) that have unit length, or none."""
    lengths = np.hypot(directions[..., 0], directions[..., 1])
    return float(np.mean((lengths < _SHORTEST) | (np.abs(lengths - 1.0) < _SHORTEST)))
