"""An upper bound of the directional albedo on a grid of directions: what conserves energy.

Dividing the BRDF by max(1, a(ωi), a(ωo)) keeps it reciprocal and its albedo at most 1, provided
that a(ω) is nowhere below the true albedo. A grating's albedo has spikes far narrower than any
affordable grid, but their ridges cross it: whichever direction is asked, some wavelength mostly
puts an order on the horizon. So each cell of the grid gets an upper bound over all directions in it
and all wavelengths of the table, and each vertex the largest of its cells; whatever is interpolated
bilinearly between vertices is then a bound too.
"""

from __future__ import annotations

import itertools
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..table import DiffractionTable
from .albedo import AlbedoModel

#: Cells in polar angle and azimuth.
POLAR, AZIMUTHAL = 40, 60
#: The grid ends at this polar angle; beyond, a bound grows with 1/cos²θ.
LAST_ANGLE = math.radians(89.5)
#: x = (1 − √(1 − 2θ/π)) / SHARE runs from 0 to 1 over the grid: denser towards grazing angles.
SHARE = 1.0 - math.sqrt(1.0 - LAST_ANGLE / (0.5 * math.pi))
#: Added for what the sums leave out: quadrature, interpolation in κ, the table's tolerance.
MARGIN = 0.01

_INSIDE = (2, 3)  # parts of a cell, polar and azimuthal, whose centres are looked at
_WAVELENGTHS = 14  # for what is smooth in λ, unless deep heights ask for more
_FINE = 4  # as many more wavelengths for the strong orders


@dataclass(frozen=True)
class AlbedoBound:
    """a(ω) ≥ directional albedo for R = 1 at every wavelength of the table.

    Attributes
    ----------
    values : (POLAR + 1, AZIMUTHAL + 1) at the vertices; the last azimuth repeats the first.
    """

    values: NDArray[np.float32]

    def __call__(self, directions: ArrayLike) -> NDArray[np.float64]:
        """Bound at unit vectors (n, 3) in the patch's frame, above the surface."""
        x, y, z = np.moveaxis(np.asarray(directions, float), -1, 0)
        theta = np.arccos(np.clip(z, 0.0, 1.0))
        row = np.minimum(position_of(theta), POLAR * (1.0 - 1e-9))
        column = np.mod(np.arctan2(y, x), 2.0 * np.pi) * (AZIMUTHAL / (2.0 * np.pi))
        column = np.minimum(column, AZIMUTHAL * (1.0 - 1e-9))
        i, j = row.astype(int), column.astype(int)
        s, t = row - i, column - j
        low = self.values[i, j] * (1.0 - t) + self.values[i, j + 1] * t
        high = self.values[i + 1, j] * (1.0 - t) + self.values[i + 1, j + 1] * t
        beyond = np.maximum(math.cos(LAST_ANGLE) / np.maximum(z, 1e-6), 1.0)
        return (low * (1.0 - s) + high * s) * beyond**2


def polar_angle(position: ArrayLike) -> NDArray[np.float64]:
    """θ (rad) of a position 0 … POLAR on the grid, which is denser towards grazing angles."""
    return 0.5 * math.pi * (1.0 - (1.0 - SHARE * np.asarray(position, float) / POLAR) ** 2)


def position_of(theta: ArrayLike) -> NDArray[np.float64]:
    """The inverse of `polar_angle`, beyond POLAR for angles beyond the last."""
    remaining = np.maximum(1.0 - np.asarray(theta, float) / (0.5 * math.pi), 0.0)
    return (1.0 - np.sqrt(remaining)) * (POLAR / SHARE)


def albedo_bound(table: DiffractionTable, height_scale: float = 1.0) -> AlbedoBound:
    """Bound a table's albedo for one height scale: a few seconds for a rough patch."""
    model = AlbedoModel(table, height_scale)
    coarse, fine = _wavelengths(table, height_scale)
    azimuths = np.arange(AZIMUTHAL) * (2.0 * np.pi / AZIMUTHAL)
    parts = AZIMUTHAL * _INSIDE[1]
    inside = (np.arange(parts) + 0.5) * (2.0 * np.pi / parts)

    def smooth(theta: float) -> NDArray[np.float32]:
        return np.stack([model.weak(theta, azimuths, wavelength) for wavelength in coarse])

    def cell_row(row: int) -> NDArray[np.float32]:
        edges = polar_angle(row + np.arange(_INSIDE[0] + 1) / _INSIDE[0])
        around = np.maximum(weak[row], weak[row + 1])
        around = np.maximum(around, np.roll(around, -1, axis=1))
        angles = np.linspace(edges[0], edges[-1], 5)
        mirror = [
            max(model.order_0(angle, wavelength) for angle in angles) for wavelength in coarse
        ]
        around += np.array(mirror, np.float32)[:, None]
        total = _strong(model, edges, inside, fine)
        total += _interpolated(around, _FINE)
        return total.max(axis=0)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        weak = list(pool.map(smooth, polar_angle(np.arange(POLAR + 1))))
        cells = np.array(list(pool.map(cell_row, range(POLAR))))
    return AlbedoBound(_largest_around(cells * np.float32(1.0 + MARGIN)))


def _wavelengths(
    table: DiffractionTable, height_scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (nm) for what is smooth, and the centres of _FINE parts of each interval."""
    low, high = table.wavelength_range
    # |a_j|² oscillates with κH/2 with the period π; κ is at most 2k
    periods = 4e3 * height_scale * table.expansion.half_range * (1.0 / low - 1.0 / high)
    intervals = int(np.clip(8.0 * periods, _WAVELENGTHS, 4 * _WAVELENGTHS))
    edges = np.geomspace(low, high, intervals + 1)
    parts = (np.arange(intervals * _FINE) + 0.5) / (intervals * _FINE)
    return edges, low * (high / low) ** parts


def _interpolated(values: NDArray[np.float32], parts: int) -> NDArray[np.float32]:
    """Along the first axis, from the edges of intervals to the centres of their parts."""
    share = ((np.arange(parts) + 0.5) / parts).astype(np.float32)[:, None]
    between = values[:-1, None] * (1.0 - share) + values[1:, None] * share
    return between.reshape(-1, values.shape[1])


def _strong(
    model: AlbedoModel,
    edges: NDArray[np.float64],
    azimuths: NDArray[np.floating],
    wavelengths: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Bound (wavelengths, AZIMUTHAL) of the strong orders' sum over each cell of a row."""
    parts = len(azimuths)
    result = np.zeros((len(wavelengths), parts), np.float32)
    half_step = 0.5 * math.log(wavelengths[1] / wavelengths[0])
    for low, high in itertools.pairwise(edges):
        theta, polar = 0.5 * (low + high), 0.5 * (high - low)
        azimuthal = math.sin(high) * math.pi / parts
        # An order at q/k moves by as much as ωi, and by |q|/k ≤ 1 + sinθi per change of lnλ
        shift = math.hypot(polar * math.cos(low), azimuthal) + (1.0 + math.sin(high)) * half_step
        for n, wavelength in enumerate(wavelengths):
            strong = model.strong(theta, azimuths, wavelength, shift)
            np.maximum(result[n], strong, out=result[n])
    return result.reshape(len(wavelengths), AZIMUTHAL, _INSIDE[1]).max(axis=2)


def _largest_around(cells: NDArray[np.float32]) -> NDArray[np.float32]:
    """From cells (POLAR, AZIMUTHAL) to vertices, each the largest of the cells around it."""
    rows = np.concatenate([cells[:1], np.maximum(cells[1:], cells[:-1]), cells[-1:]])
    rows[0] = rows[0].max()  # all cells of the first row meet at the normal
    vertices = np.maximum(rows, np.roll(rows, 1, axis=1))
    return np.concatenate([vertices, vertices[:, :1]], axis=1)
