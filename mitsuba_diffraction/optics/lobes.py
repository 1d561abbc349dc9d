"""Nodes across Gaussian lobes that the horizon cuts (NumPy, float64)."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arrays import Real

#: A lobe exp(−|Δ|²/width²) ends here, in units of its width: exp(−3.5²) = 5e-6.
LOBE_END = 3.5
# Gauss and Legendre's nodes across a lobe that the horizon cuts, and its end there: means of 1/cosθ
# are within 2 %.
_NODES, _END = 5, 2.5


def nodes_across(
    width: float, radius: Real, least: float
) -> tuple[NDArray[np.integer], Real, Real]:
    """Return nodes (m,) of lobes (n,): the lobe, cosθo, and the share of the lobe; lobe by lobe.

    A lobe that the horizon cuts has several, since light changes across it as 1/cosθo. Any other
    lobe has one, its middle.

    width : of the lobes; radius : of their middles from the normal, in direction cosines.
    least : smallest cosθo.
    """
    cut = radius > 1.0 - _END * width
    counts = np.where(cut, _NODES, 1)
    several = np.repeat(cut, counts)
    cosine, share = np.empty(len(several)), np.ones(len(several))
    cosine[~several] = np.sqrt(1.0 - radius[~cut] ** 2)
    middle = radius[cut, None]
    low, high = (np.clip(middle + side * _END * width, 0.0, 1.0) for side in (-1, 1))
    last, first = np.sqrt(1.0 - low**2), np.sqrt(1.0 - high**2)
    place, weights = np.polynomial.legendre.leggauss(_NODES)
    cos_o = np.maximum(first + (last - first) * 0.5 * (1.0 + place), least)
    sin_o = np.sqrt(1.0 - cos_o**2)
    # d(sinθo) = cosθo/sinθo d(cosθo)
    lobe = weights * np.exp(-(((sin_o - middle) / width) ** 2)) * cos_o / sin_o
    visible = 0.5 * scipy.special.erfc((middle - 1.0) / width)
    cosine[several] = cos_o.ravel()
    share[several] = (lobe * (visible / lobe.sum(axis=1, keepdims=True))).ravel()
    return np.repeat(np.arange(len(radius)), counts), cosine, share
