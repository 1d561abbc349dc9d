"""The sum of an order's lobe over daylight, for RGB variants.

Under a Gaussian window of standard deviation σ, order m of a period d has the lobe
(k²σ²/π) exp(−σ²[(ku − q_m)² + k²v²]) with q_m = 2πm/d. With ρ² = u² + v², as a function of k it is

    (k²σ²/π) exp(−σ²q_m²v²/ρ²) exp(−σ²ρ²(k − k_m)²),   k_m = u q_m/ρ²,

so that for m ≠ 0 the sum over daylight needs a weight of colour, smoothed by a Gaussian of
variance 1/(2σ²ρ²): H(k_m, variance). Order 0 leaves at u = 0 whatever the wavelength; it is summed
over a few of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..optics.colour import linear_srgb, response
from ..tables.colour.proposals import IMPORTANCE

#: Ends of the sum, nm: beyond, the observer sees less than 1e-4 of the light.
ENDS = (380.0, 780.0)
#: Channels of a weight: red, green, blue, and the density of drawn wavelengths.
CHANNELS = 4

_BINS, _STEP = 200, 0.25  # of the density; nm, of integrals
_WAVES, _VARIANCES, _ORDER_0 = 256, 9, 12


class Daylight(NamedTuple):
    """Weights of colour.

    Attributes
    ----------
    cumulative : (bins + 1,) cumulative probability of drawn wavelengths, even from `ENDS[0]` to
        `ENDS[1]`, constant density in a bin.
    waves : smallest and largest k_m of `smoothed`, rad/µm.
    variances : smallest and largest variance, (rad/µm)².
    smoothed : (variances, k, 4) ∫ s̄ k² N(k; k_m, variance) dλ, even steps along both.
    order_0 : (n, 4) weights of the wavelengths that order 0 is summed over.
    wavelengths : (n,) of these, nm.
    """

    cumulative: NDArray[np.float64]
    waves: tuple[float, float]
    variances: tuple[float, float]
    smoothed: NDArray[np.float64]
    order_0: NDArray[np.float64]
    wavelengths: NDArray[np.float64]


def daylight_weights(sigma: float, period: float) -> Daylight:
    """Tabulate the weights for lobes of a window of σ (µm) and orders of a period (µm)."""
    lam = np.arange(ENDS[0] + 0.5 * _STEP, ENDS[1], _STEP)
    colours = linear_srgb(response(lam)) * _STEP
    colours /= colours.sum(axis=0)
    per_bin = len(lam) // _BINS
    density = (np.abs(colours) @ IMPORTANCE).reshape(_BINS, per_bin).mean(axis=1).repeat(per_bin)
    density /= density.sum()
    weights = np.column_stack([colours, density])
    cumulative = np.append(0.0, density.cumsum()[per_bin - 1 :: per_bin])
    k = 2e3 * np.pi / lam
    # ρ is between that of order 1 at the shortest wavelength and 2
    variances = 0.5 / (2.0 * sigma) ** 2, 0.5 / (sigma * 1e-3 * ENDS[0] / period) ** 2
    margin = 4.0 * math.sqrt(variances[1])
    waves = max(float(k.min()) - margin, 0.25 * float(k.min())), float(k.max()) + margin
    places = np.linspace(*waves, _WAVES)
    smoothed = []
    for variance in np.linspace(*variances, _VARIANCES):
        normal = np.exp(-0.5 * (places[:, None] - k) ** 2 / variance)
        smoothed.append(normal @ (weights * k[:, None] ** 2) / math.sqrt(2.0 * np.pi * variance))
    nodes = np.linspace(k.max(), k.min(), _ORDER_0 + 2)[1:-1]
    hats = np.stack([np.interp(k, nodes[::-1], row[::-1]) for row in np.eye(_ORDER_0)])
    return Daylight(
        cumulative, waves, variances, np.stack(smoothed), hats @ weights, 2e3 * np.pi / nodes
    )
