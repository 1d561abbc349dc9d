"""Means over Gaussian lobes that the horizon cuts (NumPy, float64)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..arrays import Real

#: A lobe exp(−|Δ|²/width²) ends here, in units of its width: exp(−3.5²) = 5e-6.
LOBE_END = 3.5
#: Nodes in cosθo across a lobe.
LOBE_NODES = 96


class LobeMeans(NamedTuple):
    """Share of lobes that is above the horizon, and means of cosθo and of 1/cosθo over it."""

    visible: Real
    cosine: Real
    pole: Real


def lobe_means(width: float, radius: Real) -> LobeMeans:
    """Return means over lobes of a width with centres at a distance from the normal.

    width, radius : in direction cosines.
    """
    cosine = np.sqrt(np.maximum(1.0 - radius**2, 1e-12))
    places, at_horizon = _lobes(width)
    means = LobeMeans(np.ones_like(radius), cosine, 1.0 / cosine)
    below = radius > places[0]
    place = (radius[below] - places[0]) * ((len(places) - 1) / (places[-1] - places[0]))
    lower = np.minimum(place.astype(np.int32), len(places) - 2)
    share = np.minimum(place - lower, 1.0)
    for mean, cut in zip(means, at_horizon, strict=True):
        mean[below] = cut[lower] + (cut[lower + 1] - cut[lower]) * share
    return means


@lru_cache(maxsize=64)
def _lobes(width: float) -> tuple[Real, LobeMeans]:
    """Tabulate the means against the distance, from where part of a lobe is below the horizon."""
    edge = max(1.0 - 2.0 * LOBE_END * width, 0.0)
    deepest = math.sqrt(1.0 - max(edge - LOBE_END * width, 0.0) ** 2)
    cosines = (np.arange(LOBE_NODES) + 0.5) * (deepest / LOBE_NODES)
    sines = np.sqrt(1.0 - cosines**2)
    places = np.linspace(edge, 1.0 + LOBE_END * width, 96)
    lobes = np.exp(-(((sines - places[:, None]) / width) ** 2))
    lobes *= deepest / LOBE_NODES / (math.sqrt(math.pi) * width) * cosines / sines
    visible = np.minimum(lobes.sum(axis=1), 1.0)
    safe = np.maximum(visible, 1e-30)
    visible[-1] = 0.0
    return places, LobeMeans(visible, lobes @ cosines / safe, lobes @ (1.0 / cosines) / safe)
