"""A scale fitted where albedos are looked at, at its nodes and amid them (NumPy only).

Between nodes a scale is interpolated, and what it is multiplied with has kinks there. So it is no
solution of equations at nodes: each albedo that is looked at has limits, and the nodes around one
that is outside of them are moved by a part of what is missing (in the logarithm), on the mean over
what is looked at around each. At last what is still too much is taken from all nodes around it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from . import gain
from .grid import Interpolation

Real = NDArray[np.float64]
Array = NDArray[np.float32]

#: An albedo up to 1 may change by this share, to be at most `MOST`; one above 1 may fall to `LEAST`
#: as well. That is half of what is tolerated: the rest is for what lies between the samples.
TOLERANCE, LEAST, MOST = 0.006, 0.98, 0.994
#: Above this albedo, `LEAST` will do.
GAINS = 1.02
#: From this polar angle on, part of a lobe is below the horizon: there so much less will do.
GRAZING, LESS = math.cos(math.radians(81.0)), 0.1
#: Where light fades so much of what is left of it will do.
FADED = 0.4
#: s is at most this.
LARGEST = 1.5
#: What is taken at last: so often by the root of it, then by all.
GENTLE = 3
#: Nodes around which so little is looked at are as the nearest others.
FEW = 0.05


@dataclass(frozen=True)
class Pace:
    """Of a fit: how many steps it has; the part of what is missing that each goes, of which half
    would give both ends of a pair of directions all of it; and of the step before. At last albedos
    are at most `ceiling`.
    """

    steps: int
    part: float
    inertia: float
    ceiling: float


#: Of a grating, whose directions hang together by few orders, and of other surfaces; and of these
#: if they have Kirchhoff's spikes, which are more than is looked at.
FEW_ORDERS, MANY_ORDERS = Pace(40, 0.9, 0.0, 0.997), Pace(24, 0.5, 0.6, 0.997)
SPIKES = replace(MANY_ORDERS, ceiling=0.992)


def limits(raw: Real | Array, cosine: Real, faded: Real | Array) -> tuple[Real, Real]:
    """Least and most that an albedo is to be conserved as, from what it is, and its cosθ.

    faded : what it is by `gain.fade`, if it has that: nothing is to make up for it.
    """
    raw = np.maximum(raw, 1e-6)  # quadrature may fall below 0
    least = np.minimum(
        (1.0 - TOLERANCE) * raw, np.interp(raw, (1.0, GAINS), (1.0 - TOLERANCE, LEAST))
    )
    low = np.minimum(least, MOST) * np.where(cosine < GRAZING, 1.0 - LESS, 1.0)
    low = np.where(cosine < gain.GRAZING, np.minimum(low, FADED * faded), low)
    return low, np.minimum((1.0 + TOLERANCE) * raw, MOST)


@dataclass(frozen=True)
class Samples:
    """Albedos of one wavelength that are looked at.

    Attributes
    ----------
    page : of a scale's wavelengths, or amid two.
    here : interpolation to their directions (…).
    transport : their albedos (…), from weights on the grid.
    low, high : their limits (…).
    """

    page: float
    here: Interpolation
    transport: Callable[[Array], Array]
    low: Real
    high: Real

    @property
    def pages(self) -> set[int]:
        """Of the scale's wavelengths, those to its sides."""
        return {math.floor(self.page), math.ceil(self.page)}

    def missing(self, scale: Array) -> Real:
        """Sums at nodes of the logarithms of what albedos are to be multiplied with."""
        kept = self._kept(scale)
        missing = np.log(np.clip(kept, self.low, self.high) / kept)
        return self.here.spread(missing).reshape(scale[0].shape)

    def excess(self, scale: Array, ceiling: float) -> Real:
        """By what factor, at least 1, an albedo around each node is too much."""
        much = self._kept(scale) / ceiling
        return self.here.largest(much).reshape(scale[0].shape)

    def _kept(self, scale: Array) -> Real:
        first, *other = (scale[n] for n in self.pages)
        s = 0.5 * (first + other[0]) if other else first
        return np.maximum(self.here(s) * self.transport(s), 1e-6)


def fitted(scale: Array, samples: Sequence[Samples], pace: Pace) -> Array:
    """s (pages, rows, columns), from where it begins."""
    shape = scale.shape[1:]

    def at_pages(found: list[Real], combine: np.ufunc, start: float) -> Real:
        total = np.full(scale.shape, start)
        for one, values in zip(samples, found, strict=True):
            for n in one.pages:
                combine(total[n], values, out=total[n])
        return total

    def missing(one: Samples) -> Real:
        return one.missing(scale)

    def excess(one: Samples) -> Real:
        return one.excess(scale, pace.ceiling)

    ones = [one.here.spread(np.ones(one.low.shape)).reshape(shape) for one in samples]
    count = np.maximum(at_pages(ones, np.add, 0.0), 1e-9)
    step = np.zeros(scale.shape)
    for _ in range(pace.steps):
        step = pace.inertia * step
        step += pace.part * at_pages(parallel(missing, samples), np.add, 0.0) / count
        scale = np.minimum(scale * np.exp(step), LARGEST).astype(np.float32)
    for page, few in zip(scale, count < FEW, strict=True):
        if few.any() and not few.all():
            nearest = distance_transform_edt(few, return_distances=False, return_indices=True)
            page[:] = page[tuple(nearest)]
    for turn in range(GENTLE + 1):
        much = at_pages(parallel(excess, samples), np.maximum, 1.0)
        scale = (scale / (much if turn == GENTLE else np.sqrt(much))).astype(np.float32)
    return scale


def parallel(one: Callable[[Any], Any], arguments: Iterable[Any]) -> list[Any]:
    """Results for all arguments, by as many threads as there are processors."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(one, arguments))
