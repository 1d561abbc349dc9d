"""R + T as a linear map of weights of directions on both sides, and scales that bring it near 1."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from .conservation import scaled
from .links import Real

#: Weights of directions, and sums.
Sums = NDArray[np.floating[Any]]

#: Light that goes to and fro beyond the critical angle takes more of them than reflection does.
SWEEPS = 30
#: R + T is left altogether if it is nowhere below the first and above the last, and otherwise
#: brought between those amid.
LEAST, AIM, MOST, TOLERATED = 0.99, 0.993, 0.999, 1.001
#: Least that order 0 must leave for s not to be needed; by how much order 0 may change; and below
#: what share it is not changed.
ENOUGH, STRONGEST, FAINT = 0.98, 2.0, 1e-4
#: Beyond `LinkedSums.certain` ever less is brought back, by so much a radian: part of a lobe is
#: below the horizon.
FALL = 1.0
#: Where it differs between neighbours, this share of that is kept free below `MOST`, at most so
#: much: for what lies between them.
BETWEEN, MARGIN = 0.25, 0.006


class LinkedSums(ABC):
    """R + T from weights, (2, …) of directions on both sides.

    Attributes
    ----------
    certain : polar angle (rad) up to which they are to be 1.
    """

    certain = float(np.radians(75.5))

    @abstractmethod
    def __call__(self, s: Sums) -> Sums:
        """Sums over all orders."""

    @abstractmethod
    def zeroth(self, s: Sums) -> Sums:
        """Order 0 alone."""

    def balanced(self, aim: Sums) -> Sums:
        """What of such sums reciprocity allows, as far as that is known."""
        return aim

    def changed(self, c: Sums, here: Sums) -> Callable[[Sums], Sums]:
        """R + T from weights, with order 0 scaled by c on the grids and at the directions."""
        return lambda s: self(s) - self.zeroth(s) + here * self.zeroth(c * s)


def solved(sums: LinkedSums, ones: Sums, angle: Real) -> Sums:
    """c, then s, of both sides, (4, …); angle : polar angles, rad, that broadcast to it."""
    c, s = ones, ones
    total = sums(ones)
    if not _near_1(total, angle <= LinkedSums.certain, LEAST):
        zeroth = sums.zeroth(ones)
        wanted = _aims(total, angle - sums.certain) - (total - zeroth)
        wanted = np.clip(wanted, zeroth / STRONGEST, zeroth * STRONGEST)
        later = sums.certain - LinkedSums.certain
        c = scaled(sums.zeroth, wanted, angle - later, SWEEPS)
        c = np.where(zeroth > FAINT, c, np.float32(1.0))
        changed = sums.changed(c, c)
        total = changed(ones)
        if not _near_1(total, angle <= LinkedSums.certain, ENOUGH):
            aim = sums.balanced(_aims(total, angle - sums.certain))
            s = scaled(changed, aim, angle - later, SWEEPS)
            # Where there is no such scale, light is lost rather than gained
            s = s * np.minimum(1.0, aim / np.maximum(s * changed(s), 1e-6))
    return np.concatenate([c, s])


def _near_1(sums: Sums, certain: NDArray[np.bool_], least: float) -> bool:
    return bool(np.all((sums >= least) & (sums <= TOLERATED) | ~certain))


def _aims(sums: Sums, beyond: Real) -> Sums:
    """What R + T is to be; beyond : `certain`, rad."""
    most = MOST - np.minimum(BETWEEN * _variation(sums), MARGIN)
    least = AIM - FALL * np.maximum(beyond, 0.0)
    return np.asarray(np.clip(sums, least.astype(np.float32), most), np.float32)


def _variation(sums: Sums) -> Sums:
    """Largest less least of a direction and those around it."""
    if sums.ndim > 3:  # of chains, whose nodes lie where it changes
        return np.zeros_like(sums)
    around = {"size": (1, 3, 3), "mode": ["nearest", "nearest", "wrap"]}
    return np.asarray(maximum_filter(sums, **around) - minimum_filter(sums, **around))
