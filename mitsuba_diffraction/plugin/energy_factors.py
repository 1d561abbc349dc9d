"""Factors on heights and lengths for which scales of energy are tabulated.

A patch stretched by a reflects light of wavelength λ as the patch itself, with heights divided by
a, reflects light of λ/a: all lengths are divided by a. So the tables of the unstretched patch serve
it too, at other wavelengths and height scales. Indices are exact at one factor for each height
scale: at `centre`, or if the heights' factor is one, at what divides it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..tables.energy.conservation import Energy

#: Smallest factor over the largest that is tabulated: smaller ones have the values of this one.
LEAST_SHARE = 0.25
#: Factors of an optimisation, and ranges, are rounded outwards to powers of 2^(1/8), so that it
#: waits rarely. One factor is exact: a film's fringes were 2 % off, and white beneath was 1.07.
STEPS_PER_OCTAVE = 8
#: Of steps, for factors in single precision.
_ROUNDING = 1e-4
#: Largest share by which the stretch of a height scale may leave the range that is tabulated.
_BEYOND = 1.5


class ScaleRange(NamedTuple):
    """Factors that energy is conserved for.

    heights, stretch : least and largest factor on heights, and on lengths over the table's.
    varies : whether either varies over the surface.
    differentiable : whether derivatives with respect to either are wanted.
    """

    heights: tuple[float, float]
    stretch: tuple[float, float]
    varies: bool
    differentiable: bool

    @property
    def height_scale(self) -> float:
        """Height scale to look up where neither factor varies."""
        return self.heights[1] / self._tabulated[0]

    @property
    def centre(self) -> float:
        """Factor on lengths at which wavelengths equal the light's."""
        low, high = self._rounded
        return math.sqrt(low * high)

    def nodes(self, scales: Energy) -> list[float]:
        """Return the height scales at which a function of them is tabulated."""
        high = self.height_scale
        low = self.heights[0] / self.stretch[1] if self.varies else high
        return scales.nodes(low, high, interval=self.differentiable)

    def stretch_at(self, height_scale: float) -> float:
        """Return the factor on lengths at which a height scale's indices are exact.

        It is `centre` where the heights' own factor varies, or the factor on lengths does not.
        """
        if self.heights[0] != self.heights[1] or self.stretch[0] == self.stretch[1]:
            return self.centre
        low, high = self._rounded
        # the first and the last height scale may lie beyond the range of those looked up
        return min(max(self.heights[1] / height_scale, low / _BEYOND), high * _BEYOND)

    def wavelengths(self, wavelength_range: tuple[float, float]) -> tuple[float, float]:
        """Return the range λ/a of wavelengths λ, nm."""
        low, high = self._rounded
        return wavelength_range[0] / high, wavelength_range[1] / low

    @property
    def least(self) -> float:
        """Least factor on lengths that is tabulated."""
        return self._tabulated[0]

    @property
    def _rounded(self) -> tuple[float, float]:
        if self.stretch[0] == self.stretch[1] and not self.differentiable:
            one = round(self.stretch[0], 6)  # of single precision
            return one, one
        low, high = (math.log2(factor) * STEPS_PER_OCTAVE for factor in self._tabulated)
        ends = math.floor(low + _ROUNDING), math.ceil(high - _ROUNDING)
        return 2.0 ** (ends[0] / STEPS_PER_OCTAVE), 2.0 ** (ends[1] / STEPS_PER_OCTAVE)

    @property
    def _tabulated(self) -> tuple[float, float]:
        low, high = self.stretch
        return max(low, LEAST_SHARE * high), high
