"""Nodes across Gaussian lobes that the horizon or a critical angle cuts (NumPy, float64)."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arrays import Real

#: A lobe exp(−|Δ|²/width²) ends here, in units of its width: exp(−3.5²) = 5e-6.
LOBE_END = 3.5
# Gauss and Legendre's nodes across either part of a lobe that is cut, and its end there: means of
# 1/cosθ are within 2 %, and light let through before the horizon is within 3 %.
_NODES, _END = 4, 2.5
_TINY = 1e-9  # of lobes beyond the horizon, whose nodes lie on it


def nodes_across(
    width: float, radius: Real, least: float, edge: float = 1.0
) -> tuple[NDArray[np.integer], Real, Real]:
    """Return nodes (m,) of lobes (n,): the lobe, cosθo, and the share of the lobe; lobe by lobe.

    A lobe that the horizon cuts has several, since light changes across it as 1/cosθo. A lobe that
    the critical angle cuts has several on either side. Any other lobe has one, its middle.

    width : of the lobes; radius : of their middles from the normal, in direction cosines.
    least : smallest cosθo.
    edge : sine of the critical angle; 1 without one.
    """
    cut = (radius > 1.0 - _END * width) | (np.abs(radius - edge) < _END * width)
    middle = radius[cut, None]
    low, high = (np.clip(middle + side * _END * width, 0.0, 1.0) for side in (-1, 1))
    first, last = np.sqrt(1.0 - low**2), np.sqrt(1.0 - high**2)
    across = (low < edge) & (edge < high)
    between = np.where(across, math.sqrt(1.0 - edge**2), 0.5 * (first + last))
    place, weights = np.polynomial.legendre.leggauss(_NODES)
    cosines, lobes = [], []
    for start, end in pairwise([first, between, last]):
        cos_o = np.maximum(end + (start - end) * 0.5 * (1.0 + place), least)
        sin_o = np.sqrt(1.0 - cos_o**2)
        # d(sinθo) = cosθo/sinθo d(cosθo)
        steps = weights * np.maximum(start - end, _TINY) * cos_o / sin_o
        lobes.append(steps * np.exp(-(((sin_o - middle) / width) ** 2)))
        cosines.append(cos_o)
    lobe = np.concatenate(lobes, axis=1)
    visible = 0.5 * scipy.special.erfc((middle - 1.0) / width)
    counts = np.where(cut, lobe.shape[1], 1)
    several = np.repeat(cut, counts)
    cosine, share = np.empty(len(several)), np.ones(len(several))
    cosine[~several] = np.sqrt(1.0 - radius[~cut] ** 2)
    cosine[several] = np.concatenate(cosines, axis=1).ravel()
    share[several] = (lobe * (visible / lobe.sum(axis=1, keepdims=True))).ravel()
    return np.repeat(np.arange(len(radius)), counts), cosine, share
