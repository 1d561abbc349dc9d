"""How much colours change from one table to another, over random directions (NumPy only)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import delta_e, linear_srgb, response
from ..table import DiffractionTable
from .build import VISIBLE
from .table import ColourTable

_PAIRS = 1500  # of directions; the mean of their ΔE is known to some per cent
_STEP = 2.0  # nm


def colour_difference(table: ColourTable, other: ColourTable) -> NDArray[np.float64]:
    """ΔE2000 (n,) between two colour tables, over random pairs of directions."""
    u, v, z, factor = _pairs(_PAIRS)
    return _loss(table.colour(u, v, z), other.colour(u, v, z), factor)


def power_colour_difference(
    table: DiffractionTable, other: DiffractionTable
) -> NDArray[np.float64]:
    """ΔE2000 (n,) between two tables of powers, summed over daylight's wavelengths."""
    u, v, z, factor = _pairs(_PAIRS // 3)
    lam = np.arange(*VISIBLE, _STEP)[:, None]
    weights = linear_srgb(response(lam[:, 0])) / lam**2
    k = 2e3 * np.pi / lam
    exact, found = (t.window_sum(k * u, k * v, k * z).T @ weights for t in (table, other))
    return _loss(exact, found, factor)


def _pairs(count: int) -> tuple[NDArray[np.float64], ...]:
    """u, v, z of random pairs of directions away from the specular one, and w² to divide by.

    Half of them in the planes of the axes, out of which gratings with one period send nothing.
    """
    rng = np.random.default_rng(2)
    radius, turn = (
        np.sqrt(rng.uniform(0, 0.95, (2, _PAIRS))),
        rng.uniform(0, 2 * np.pi, (2, _PAIRS)),
    )
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    z = np.sqrt(1.0 - radius**2)
    u, v = x.sum(axis=0), y.sum(axis=0)
    u[::4] = v[1::4] = 0.0
    return u, v, z.sum(axis=0), z.sum(axis=0) ** -2 / z[0]


def _loss(
    exact: NDArray[np.float64], other: NDArray[np.float64], factor: NDArray[np.float64]
) -> NDArray[np.float64]:
    found = delta_e(exact * factor[:, None], other * factor[:, None])
    return found[np.isfinite(found)]
