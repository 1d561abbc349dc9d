"""Factors on a patch's heights and on its lengths in the plane: numbers, textures, attributes."""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError
from .description import Quantity
from .memory import index_between
from .parameter_changes import Bounded, Changeable, ObjectValues
from .properties import number
from .textures import is_bitmap, range_of, require_raw
from .types import Float, Interaction, Mask, Properties, Texture

#: Flatter would be lost in single precision.
LEAST_SCALE = 1e-30


class FactorLimits(NamedTuple):
    """Name of a factor, and the least and largest numbers that a scene may give for it.

    A number of the scene is above 0; `least` is the bound for textures.
    """

    name: str
    least: float
    most: float


HEIGHT = FactorLimits("height_scale", 0.0, 1e3)
#: Beyond, the coherence window covers no period of any grating, or all of a scan.
LATERAL = FactorLimits("lateral_scale", 0.01, 100.0)


class VaryingFactor:
    """A texture's or mesh attribute's number at each point, between bounds.

    Parameters
    ----------
    texture : of one channel; a bitmap is raw.
    largest : the largest factor, which mesh attributes and procedural textures must be given; None
        for a bitmap's own.
    limits : name and bounds of the factor.

    high : the largest factor; larger ones are clamped to it.
    """

    def __init__(self, texture: Texture, largest: float | None, limits: FactorLimits) -> None:
        self.texture, self._limits = texture, limits
        name = limits.name
        if not is_bitmap(texture) and largest is None:
            raise DiffractionError(
                f"{name} of a texture other than a bitmap, or of a mesh attribute, needs "
                f"{name}_max, the largest factor that it has"
            )
        require_raw(texture, name, "factors")
        self.high = self.range()[1] if largest is None else largest
        if not max(limits.least, LEAST_SCALE) <= self.high <= limits.most:  # also refuses NaN
            described = "its largest factor" if largest is None else f"{name}_max"
            bounds = f"at least {limits.least:g}" if limits.least else "above 0"
            raise DiffractionError(
                f"{name}: {described}, {self.high:g}, must be {bounds} and at most {limits.most:g}"
            )
        if refused := self.refusal():
            raise DiffractionError(refused)
        self.changeable = (ObjectValues(name, texture),)

    def range(self) -> tuple[float, float]:
        """Return the smallest and the largest factor, as far as known."""
        if not is_bitmap(self.texture):
            return self._limits.least, self.high
        known = range_of(self.texture)
        assert known is not None
        return known

    def at(self, si: Interaction, active: Mask) -> Float:
        """Return the factor at points of the surface."""
        least = max(self._limits.least, LEAST_SCALE)
        return index_between(self.texture.eval_1(si, active), least, self.high)

    def refusal(self) -> str | None:
        """Reason why the texture's factors are not allowed, or None."""
        low, high = range_of(self.texture) or self.range()
        if not is_bitmap(self.texture):
            high = min(high, self.high)  # clipped, as the documentation says
        if low >= self._limits.least and high <= self.high * (1.0 + 1e-6):
            return None
        kind = "bitmap" if is_bitmap(self.texture) else "texture"
        return (
            f"{self._limits.name}: the {kind}'s factors go from {low:g} to {high:g}; they must be "
            f"between {self._limits.least:g} and {self.high:g}"
        )

    def __str__(self) -> str:
        return " ".join(str(self.texture).split())


class LateralScale:
    """Factor by which the patch is stretched in its plane, at points of the surface.

    The table has the heights stretched by the largest factor, or unstretched where no factor is
    above 1, so that no look-up goes beyond its frequencies.

    Parameters
    ----------
    factor : a number, a texture, or None where the scene has no lateral_scale.
    most : largest value that a number may change to; None for the number itself.

    Attributes
    ----------
    of_table : factor by which the table's heights are stretched, at least 1.
    varying : the texture, or None.
    changeable : what `traverse` exposes.
    """

    def __init__(self, factor: float | VaryingFactor | None, most: float | None = None) -> None:
        largest = 1.0 if factor is None else largest_of(factor)
        self.of_table = max(1.0, largest if most is None else most)
        self.varying = factor if isinstance(factor, VaryingFactor) else None
        self._number: Bounded | None = None
        self.changeable: tuple[Changeable, ...] = ()
        if isinstance(factor, VaryingFactor):
            self.changeable = factor.changeable
        elif factor is not None:
            refused = partial(_lateral_refusal, self.of_table)
            bounds = LATERAL.least, self.of_table
            self._number = Bounded(LATERAL.name, factor, *bounds, refused)
            self.changeable = (self._number,)

    def over_table(self, si: Interaction, active: Mask) -> Float:
        """Return the factor relative to the table's; the plain number 1 without lateral_scale."""
        if self.varying is not None:
            return self.varying.at(si, active) * (1.0 / self.of_table)
        return self._number.value * (1.0 / self.of_table) if self._number is not None else 1.0

    def range_over_table(self) -> tuple[float, float]:
        """Return the least and the largest factor relative to the table's, as far as known."""
        if self.varying is not None:
            low, high = self.varying.range()
            return low / self.of_table, min(high, self.varying.high) / self.of_table
        if self._number is None:
            return 1.0, 1.0
        factor = float(dr.slice(dr.detach(self._number.value))) / self.of_table
        return factor, factor

    @property
    def quantity(self) -> Quantity:
        """The factor relative to the table's, for descriptions."""
        texture = None if self.varying is None else self.varying.texture
        return Quantity(self.range_over_table()[1], texture)

    @property
    def differentiable(self) -> bool:
        """Whether derivatives with respect to the number are wanted."""
        return self._number is not None and dr.grad_enabled(self._number.value)

    def __str__(self) -> str:
        if self._number is not None:
            return f"{dr.slice(self._number.value):g}"
        return str(self.varying or 1)


def read_factor(props: Properties, limits: FactorLimits) -> float | VaryingFactor:
    """Return a scene's factor, 1 by default, or the texture of factors.

    Raises a DiffractionError with the parameter, its value and the allowed values.
    """
    name, largest = limits.name, f"{limits.name}_max"
    texture = dict(props.objects()).get(name)
    most = number(props, largest, math.nan) if largest in props else None
    if isinstance(texture, mi.Texture):
        return VaryingFactor(texture, most, limits)
    if most is not None and limits is HEIGHT:
        raise DiffractionError(f"{largest} is for a {name} that is a texture")
    factor = number(props, name, 1.0)
    if not max(limits.least, LEAST_SCALE) <= factor <= limits.most:
        bounds = f"at least {limits.least:g}" if limits.least else "above 0"
        raise DiffractionError(f"{name}={factor:g} must be {bounds} and at most {limits.most:g}")
    return factor


def read_lateral(props: Properties) -> LateralScale:
    """Return a scene's lateral_scale; without it, kernels have no operation for it.

    Raises a DiffractionError with the parameter, its value and the allowed values.
    """
    name, largest = LATERAL.name, f"{LATERAL.name}_max"
    factor = read_factor(props, LATERAL) if name in props else None
    if largest not in props or isinstance(factor, VaryingFactor):
        return LateralScale(factor)
    if factor is None:
        raise DiffractionError(f"{largest} is for a {name}; give both, or none")
    most = number(props, largest, math.nan)
    if not factor <= most <= LATERAL.most:
        raise DiffractionError(
            f"{largest}={most:g} must be at least {name}, {factor:g}, and at most {LATERAL.most:g}"
        )
    return LateralScale(factor, most)


def largest_of(factor: float | VaryingFactor) -> float:
    """Return the largest factor."""
    return factor.high if isinstance(factor, VaryingFactor) else factor


def _lateral_refusal(most: float, factor: float) -> str:
    return (
        f"lateral_scale={factor:g} is outside the table's range, {LATERAL.least:g} to "
        f"{most:g}; load the plugin anew with that lateral_scale_max"
    )
