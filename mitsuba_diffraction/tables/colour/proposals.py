"""Where a surface sends daylight: densities over (u, v) to draw directions from, for RGB variants.

The cells lie between the rings and azimuths of the colour table, and hold its brightness,
integrated over the cell. It depends on z = w·height_scale, which varies with the direction drawn: a
few bands of z have densities of their own. Order 0 is a sum of Gaussians, one for each of a few
wavelengths, with the weight of its own brightness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..sampling import band_shares, cumulative
from .table import PACKET, TERMS, ColourTable

#: Weights of the channels: between the luminance (0.21, 0.72, 0.07) and equal noise in all three.
IMPORTANCE = (0.25, 0.55, 0.2)
#: Bands of z up to `sampling.BANDED` of the largest.
BANDS = 6
#: Wavelengths (µm) whose lobes make up order 0's.
LOBES = (0.45, 0.52, 0.57, 0.63)


@dataclass(frozen=True)
class ColourProposals:
    """Cumulative distributions over the cells, one set a band.

    Attributes
    ----------
    rings : (bands, rings) cumulative probability of the rings' cells, from 0 to 1.
    azimuths : (bands, bins) cumulative probability within a ring, from 0 to 1: the cells of a
        ring that starts at bin s are s … s + count.
    occupied : (bands,) whether there is any power besides order 0.
    order_0 : (zs,) brightness of order 0 over z, even from 0 to the largest z.
    """

    rings: NDArray[np.float32]
    azimuths: NDArray[np.float32]
    occupied: NDArray[np.bool_]
    order_0: NDArray[np.float32]


def colour_proposals(table: ColourTable) -> ColourProposals:
    """Tabulate the densities of all bands."""
    grid = table.grid
    rings = np.zeros((BANDS, grid.rings), np.float32)
    azimuths = np.zeros((BANDS, grid.bins), np.float32)
    for band in range(BANDS):
        bright = brightness(table, band_shares(band, BANDS) * table.expansion.kappa_max)
        inside = []
        for start, count in zip(map(grid.start, range(grid.rings)), grid.counts, strict=True):
            values = bright[start : start + count + 1].astype(float)
            inside.append(values[1:] + values[:-1])
        power = np.zeros(grid.rings - 1)
        for ring in range(grid.rings - 1):
            count = grid.counts[ring]
            cells = inside[ring] + _resampled(inside[ring + 1], count)
            start = grid.start(ring)
            azimuths[band, start : start + count + 1] = cumulative(cells)
            # dA = r² d(ln r) dφ
            power[ring] = np.cumsum(cells)[-1] / count * grid.radius(ring) ** 2
        rings[band] = cumulative(power)
    return ColourProposals(rings, azimuths, rings[:, -1] > 0.0, _order_0(table))


def brightness(table: ColourTable, zs: NDArray[np.float64]) -> NDArray[np.float32]:
    """Sum over some z of the brightness in each bin, without order 0, (bins,)."""
    expansion = table.expansion
    total = np.zeros(table.grid.bins, np.float32)
    for interval, weights in zip(expansion.interval(zs), expansion.weights(zs), strict=True):
        packet = np.zeros(PACKET, np.float32)
        packet[: 3 * TERMS] = np.outer(IMPORTANCE, weights).ravel() / table.scale
        total += np.maximum(table.coefficients[interval].astype(np.float32) @ packet, 0.0)
    return total


def _resampled(cells: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Means over `count` cells around the same circle."""
    if len(cells) == count:
        return cells
    sums = np.concatenate([[0.0], np.cumsum(cells)]) / len(cells)
    edges = np.interp(np.arange(count + 1) / count, np.linspace(0.0, 1.0, len(sums)), sums)
    return np.asarray(np.diff(edges) * count)


def _order_0(table: ColourTable) -> NDArray[np.float32]:
    """∫ over the lobe of order 0's brightness, 1 for a mirror."""
    radii = np.linspace(0.0, table.radius_end, table.order_0.shape[0])
    brightness = table.order_0[..., :3].astype(float) @ np.array(IMPORTANCE)
    area = 2.0 * np.pi * radii[:, None] * brightness
    integral = np.trapezoid(area, radii, axis=0)
    return np.asarray(4.0 * np.pi * table.sigma**2 * integral, np.float32)
