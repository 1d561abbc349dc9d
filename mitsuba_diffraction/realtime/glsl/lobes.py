"""Directions drawn from a surface's lobes, and their densities, for shaders/lobes.glsl.

Densities over (u, v) do not depend on the direction to the eye.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from ...arrays import Real
from ...tables.colour.build import LARGEST_RADIUS
from ...tables.colour.proposals import IMPORTANCE, brightness
from ...tables.colour.table import ColourTable
from .texels import Packed, Texture, listed

#: Cells over (u, v) in rings, and directions in a list.
RINGS, AZIMUTHS, _PLACES = 128, 1024, 1 << 16
_INNERMOST = 0.5  # radius of the innermost cell, in standard deviations of a lobe in green light
_GREEN = 2.0 * np.pi / 0.55  # rad/µm
_ZS = np.array([1.1, 1.45, 1.8])  # values of w, from oblique to nearly normal incidence
_EVERYWHERE = 0.1  # share of directions that are drawn evenly


def pack_lobes(power: Callable[[Real], Real], sigma: float) -> Packed:
    """Pack directions of a surface's lobes and their densities.

    power : function that returns the brightness in the cells (rings, azimuths) between radii.
    sigma : standard deviation of the amplitude window of the narrowest lobe, µm.
    """
    smallest = _INNERMOST / (np.sqrt(2.0) * _GREEN * sigma)
    step = np.log(LARGEST_RADIUS / smallest) / (RINGS - 1)
    edges = np.concatenate([[0.0], smallest * np.exp(step * np.arange(RINGS))])
    areas = np.diff(edges**2)[:, None] * np.full(AZIMUTHS, np.pi / AZIMUTHS)
    cells = power(edges)
    share = cells / max(float(cells.sum()), 1e-30)
    share = (1.0 - _EVERYWHERE) * share + _EVERYWHERE * areas / areas.sum()
    return Packed(
        (
            Texture("lobe_densities", (share / areas)[..., None].astype(np.float32)),
            listed("lobe_places", _lobe_places(share, edges)),
        ),
        {"lobe_smallest": float(smallest), "lobe_step": float(step)},
        {"LOBE_PLACES": str(_PLACES)},
    )


def colour_power(table: ColourTable, edges: Real, height_scale: float) -> Real:
    """Return the brightness of a table in the cells (rings, azimuths) between radii `edges`.

    height_scale : factor on the heights, the index of a coat included.
    """
    zs = np.minimum(_ZS * height_scale, table.z_max)
    grid, bright = table.grid, brightness(table, zs) / len(zs)
    cells = np.zeros((RINGS, AZIMUTHS))
    for ring, count in enumerate(grid.counts):
        radius = grid.radius(ring)
        row = int(np.clip(np.searchsorted(edges, radius) - 1, 0, RINGS - 1))
        start = grid.start(ring)
        area = radius**2 * grid.step * 2.0 * np.pi / count
        parts = 2 * max(1, AZIMUTHS // count)  # parts of a bin, half on either side of its azimuth
        spread = np.repeat(bright[start : start + count], parts) * (area / parts)
        turn = np.arange(len(spread)) * AZIMUTHS // len(spread)
        cells[row] += np.bincount(turn, np.roll(spread, -parts // 2), AZIMUTHS)
    radii = np.linspace(0.0, table.radius_end, len(table.order_0))
    places = np.rint(zs / table.z_max * (table.order_0.shape[1] - 1)).astype(int)
    profile = np.maximum(table.order_0[:, places, :3] @ np.array(IMPORTANCE), 0.0).mean(axis=1)
    within = scipy.integrate.cumulative_trapezoid(2.0 * np.pi * radii * profile, radii, initial=0.0)
    return cells + np.diff(np.interp(edges, radii, within))[:, None] / AZIMUTHS


def _lobe_places(share: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return points (u, v) (n, 2) in proportion to each cell's share, in the order of cells."""
    below = np.concatenate([[0.0], np.cumsum(share)])
    quantile = (np.arange(_PLACES) + 0.5) / _PLACES * below[-1]
    cell = np.minimum(np.searchsorted(below, quantile, side="right") - 1, share.size - 1)
    inside = (quantile - below[cell]) / (below[cell + 1] - below[cell])
    ring, azimuth = np.divmod(cell, AZIMUTHS)
    across = np.arange(_PLACES) * 0.6180339887 % 1.0
    radius = np.sqrt(edges[ring] ** 2 + (edges[ring + 1] ** 2 - edges[ring] ** 2) * across)
    phi = 2.0 * np.pi * (azimuth + inside) / AZIMUTHS
    return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=1).astype(np.float32)
