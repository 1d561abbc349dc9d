"""Albedo bounds kept by the content of their table: a few seconds' work, a few kilobytes' file."""

from __future__ import annotations

import math
import weakref
from dataclasses import dataclass

import numpy as np

from ..energy.albedo import LEAST_SPIKE, RINGS, SMOOTHING, STEPS
from ..energy.bound import AZIMUTHAL, LAST_ANGLE, MARGIN, POLAR, AlbedoBound, albedo_bound
from ..sampling.order_mixture import MOST_STRONG, STRONG
from ..table import DiffractionTable
from .store import Record, kept, key_of

#: Raised whenever the computation of a bound changes.
VERSION = 2

#: Bounds are computed for height scales n/steps: this phase (rad) changes at most in between. The
#: power of an order bends by a fiftieth then, and by less at grazing angles, where there is most
#: to bound.
_PHASE = 0.8
_FEWEST_STEPS = 4
#: As good as no heights at all.
_FLAT = 1e-3

_SETTINGS = (
    VERSION, POLAR, AZIMUTHAL, LAST_ANGLE, MARGIN, LEAST_SPIKE, RINGS, STEPS, SMOOTHING, STRONG,
    MOST_STRONG,
)  # fmt: skip

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[str, AlbedoBound]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True)
class BoundsAround:
    """Bounds at two height scales; in between, their linear interpolation is the bound.

    Attributes
    ----------
    scales : (lower, upper) height scale; equal where one is enough.
    bounds : of each.
    """

    scales: tuple[float, float]
    bounds: tuple[AlbedoBound, AlbedoBound]

    def share(self, height_scale: float) -> float:
        """Weight of the upper bound, 0 … 1."""
        low, high = self.scales
        return min(max((height_scale - low) / (high - low), 0.0), 1.0) if high > low else 0.0


def bounds_around(
    table: DiffractionTable, height_scale: float, *, interval: bool = False
) -> BoundsAround:
    """The bounds of a table's albedo at the two nodes around a height scale.

    The nodes lie evenly, 1 among them, so close that an order's power bends little in between. An
    optimisation of the heights thus sees a continuous bound with derivatives, and waits for a new
    one only where it enters an interval that nobody has been in before.

    interval : two nodes even if the scale is at one, for derivatives.
    """
    phase = 2.0 * table.q_limit * table.expansion.half_range
    steps = max(_FEWEST_STEPS, math.ceil(phase / _PHASE))
    # Beyond the table's own limit nothing can be looked up, so the last interval is shorter
    most = max(table.height_scale_max, _FLAT)

    def node(n: int) -> float:
        return min(max(n / steps, _FLAT), most)

    position = height_scale * steps  # of a scale in single precision
    lower = min(math.floor(position + 1e-4), math.ceil(most * steps - 1e-4) - 1)
    at_node = abs(position - lower) < 1e-4
    low = node(lower)
    if at_node and not interval:
        bound = _at(table, low)
        return BoundsAround((low, low), (bound, bound))
    high = node(lower + 1)
    return BoundsAround((low, high), (_at(table, low), _at(table, high)))


def cached_bound(table: DiffractionTable, height_scale: float) -> AlbedoBound:
    """The bound of a table's albedo at a height scale, from memory, from disk, or computed."""
    around = bounds_around(table, height_scale)
    low, high = (bound.values for bound in around.bounds)
    share = np.float32(around.share(height_scale))
    return AlbedoBound(low * (1 - share) + high * share)


def _at(table: DiffractionTable, height_scale: float) -> AlbedoBound:
    key = key_of(_SETTINGS, table.digest(), height_scale)
    memory = _known.setdefault(table, {})
    return kept(
        "albedo",
        key,
        memory,
        lambda: albedo_bound(table, height_scale),
        lambda bound: Record(None, [bound.values]),
        _bound_of,
    )


def _bound_of(record: Record) -> AlbedoBound:
    (values,) = record.arrays
    if values.shape != (POLAR + 1, AZIMUTHAL + 1) or not np.isfinite(values).all():
        raise ValueError(f"bounds of shape {values.shape}")
    return AlbedoBound(values)
