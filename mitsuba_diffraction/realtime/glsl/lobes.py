"""Where a surface sends light, as a shader draws it: densities over (u, v), and places drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from ...tables.colour.build import LARGEST_RADIUS
from ...tables.colour.proposals import IMPORTANCE, brightness
from ...tables.colour.table import ColourTable
from .texels import Packed, Texture, listed

_RINGS, _AZIMUTHS, _PLACES = 128, 1024, 1 << 16
_INNERMOST = 0.5  # radius of the innermost cell, in standard deviations of a lobe in the green
_GREEN = 2.0 * np.pi / 0.55  # rad/µm
_ZS = np.array([1.1, 1.45, 1.8])  # of w, from slanted to nearly normal incidence
_EVERYWHERE = 0.1  # share of what is drawn evenly


def pack_lobes(table: ColourTable, height_scale: float) -> Packed:
    """What shaders/lobes.glsl reads.

    Parameters
    ----------
    table : colours of the diffracted light.
    height_scale : factor on the heights, the index of a coat included.
    """
    smallest = _INNERMOST / (np.sqrt(2.0) * _GREEN * table.sigma)
    step = np.log(LARGEST_RADIUS / smallest) / (_RINGS - 1)
    edges = np.concatenate([[0.0], smallest * np.exp(step * np.arange(_RINGS))])
    areas = np.diff(edges**2)[:, None] * np.full(_AZIMUTHS, np.pi / _AZIMUTHS)
    power = _power(table, edges, height_scale)
    share = power / max(float(power.sum()), 1e-30)
    share = (1.0 - _EVERYWHERE) * share + _EVERYWHERE * areas / areas.sum()
    return Packed(
        (
            Texture("lobe_densities", (share / areas)[..., None].astype(np.float32)),
            listed("lobe_places", _places(share, edges)),
        ),
        {"lobe_smallest": float(smallest), "lobe_step": float(step)},
        {"LOBE_PLACES": str(_PLACES)},
    )


def _power(
    table: ColourTable, edges: NDArray[np.float64], height_scale: float
) -> NDArray[np.float64]:
    """Brightness in the cells (rings, azimuths) between these radii."""
    zs = np.minimum(_ZS * height_scale, table.z_max)
    grid, bright = table.grid, brightness(table, zs) / len(zs)
    cells = np.zeros((_RINGS, _AZIMUTHS))
    for ring, count in enumerate(grid.counts):
        radius = grid.radius(ring)
        row = int(np.clip(np.searchsorted(edges, radius) - 1, 0, _RINGS - 1))
        start = grid.start(ring)
        area = radius**2 * grid.step * 2.0 * np.pi / count
        parts = 2 * max(1, _AZIMUTHS // count)  # of a bin, which lies on both sides of its azimuth
        spread = np.repeat(bright[start : start + count], parts) * (area / parts)
        turn = np.arange(len(spread)) * _AZIMUTHS // len(spread)
        cells[row] += np.bincount(turn, np.roll(spread, -parts // 2), _AZIMUTHS)
    radii = np.linspace(0.0, table.radius_end, len(table.order_0))
    places = np.rint(zs / table.z_max * (table.order_0.shape[1] - 1)).astype(int)
    profile = np.maximum(table.order_0[:, places, :3] @ np.array(IMPORTANCE), 0.0).mean(axis=1)
    within = cumulative_trapezoid(2.0 * np.pi * radii * profile, radii, initial=0.0)
    return cells + np.diff(np.interp(edges, radii, within))[:, None] / _AZIMUTHS


def _places(share: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float32]:
    """(u, v) as often in each cell as it is drawn, in the cells' order, (n, 2)."""
    below = np.concatenate([[0.0], np.cumsum(share)])
    wanted = (np.arange(_PLACES) + 0.5) / _PLACES * below[-1]
    cell = np.minimum(np.searchsorted(below, wanted, side="right") - 1, share.size - 1)
    inside = (wanted - below[cell]) / (below[cell + 1] - below[cell])
    ring, azimuth = np.divmod(cell, _AZIMUTHS)
    across = np.arange(_PLACES) * 0.6180339887 % 1.0
    radius = np.sqrt(edges[ring] ** 2 + (edges[ring + 1] ** 2 - edges[ring] ** 2) * across)
    phi = 2.0 * np.pi * (azimuth + inside) / _AZIMUTHS
    return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=1).astype(np.float32)
