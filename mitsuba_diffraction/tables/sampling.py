"""Densities in spatial frequency to draw directions from: where a surface sends its light (NumPy).

(α, β) → ωo has the Jacobian dωo = dα dβ / (k² cosθo), so that a density proportional to the window
sum over (α, β) is almost the BRDF times cosθo. `Proposals` cuts the plane of frequencies into
square cells about one lobe of the window wide; each holds the power of all orders but order 0 that
falls into it. The power depends on κ, which varies with the direction drawn: a few bands of κ have
densities of their own. Order 0 is a Gaussian with a weight known exactly, and needs no cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from .expansion import series_sum
from .powers import order_0_power
from .table import DiffractionTable
from .window import apply_window

#: Width of a cell in units of 1/σ: a lobe is then nearly even across it.
CELL = 1.5
#: Orders further apart, in units of 1/σ, are lobes with nothing between them: erfc(2) = 0.5 %.
APART = 4.0
#: Most cells in each direction; more memory would buy little.
MOST_CELLS = 1024
#: Bands of κ at most, up to 3/4 of κ_max: κ is at most k(cosθi + 1), and k(cosθi + 1/2) picks the
#: band. Fewer where a large patch would have more levels than a core's cache holds: the look-up
#: of the density takes half as long then, and the samples' noise grows by at most a twentieth.
BANDS, BANDED = 6, 0.75
FEWEST_BANDS, CACHED = 2, 1 << 20
#: A level, a byte a cell, is the top of the cell's density in single precision, eight steps an
#: octave; this far down. Directions are drawn by the levels, so that their density is exact; the
#: rounding, 6 % at most, adds 0.1 % to the samples' variance.
SHIFT = 20

_KAPPAS = 4  # averaged in a band
_ORDER_0_KAPPAS = 2048
_SPREAD = 0.25  # half width of a band's average, as a share of κ_max: κ spreads over k


@dataclass(frozen=True)
class Proposals:
    """Cumulative distributions over the cells, one set a band.

    Attributes
    ----------
    origin : (x, y), lower corner of cell (0, 0), rad/µm.
    cell : width of a cell along x and y, rad/µm.
    lobes : along which axes a cell is one order's, and holds its lobe instead of an even density.
    levels : (bands, ny, 4·n) of a cell's density, n ≥ nx / 4 (`density_of`); 0 is none.
    units : (bands,) probability of a cell over its density; 0 where there is no power besides
        order 0.
    rows : (bands, ny + 1) cumulative probability of rows, from 0 to 1.
    columns : (bands, ny, nx + 1) cumulative probability within a row, from 0 to 1.
    order_0 : (κs,) power of order 0 over κ, even from 0 to the table's largest κ.
    """

    origin: tuple[float, float]
    cell: tuple[float, float]
    lobes: tuple[bool, bool]
    levels: NDArray[np.uint8]
    units: NDArray[np.float32]
    rows: NDArray[np.float32]
    columns: NDArray[np.float32]
    order_0: NDArray[np.float32]


def proposals(table: DiffractionTable) -> Proposals:
    """Tabulate the densities of all bands."""
    x, y = (_cells(table, axis) for axis in (0, 1))
    cell, counts = (x.width, y.width), (x.number, y.number)
    origin = (-0.5 * x.width * x.number, -0.5 * y.width * y.number)
    matrices = [_cell_matrix(table, n, origin[n], cell[n], counts[n]) for n in (0, 1)]
    bands = min(max(CACHED // (x.number * y.number), FEWEST_BANDS), BANDS)
    rows = np.zeros((bands, counts[1] + 1), np.float32)
    columns = np.zeros((bands, counts[1], counts[0] + 1), np.float32)
    levels = np.zeros((bands, counts[1], -(-counts[0] // 4) * 4), np.uint8)
    units = np.zeros(bands, np.float32)
    for band in range(bands):
        band_levels = _levels(_cell_power(table, matrices, band_shares(band, bands)))
        levels[band, :, : counts[0]] = band_levels
        power = density_of(band_levels)
        of_row = power.sum(axis=1)
        if of_row.sum() > 0.0:
            units[band] = 1.0 / of_row.sum()
            rows[band] = cumulative(of_row)
            columns[band] = cumulative(power)
    lobes = (x.lobes, y.lobes)
    # close enough together for a share of the samples
    kappas = np.linspace(0.0, table.expansion.kappa_max, _ORDER_0_KAPPAS)
    order_0 = np.clip(order_0_power(table, kappas), 0.0, 1.0).astype(np.float32)
    return Proposals(origin, cell, lobes, levels, units, rows, columns, order_0)


class _Cells(NamedTuple):
    """Cells along one axis: width in rad/µm, number, and whether each is one order's."""

    width: float
    number: int
    lobes: bool


def _cells(table: DiffractionTable, axis: int) -> _Cells:
    spacing, last = table.spacing[axis], table.grid.last[axis]
    edge = min(table.frequency_limit[axis], last * spacing) + 2.0 / table.sigma
    if spacing * table.sigma > APART:
        return _Cells(spacing, 2 * math.ceil(edge / spacing) + 1, True)
    cell = max(CELL / table.sigma, 2.0 * edge / MOST_CELLS)
    return _Cells(cell, math.ceil(2.0 * edge / cell), False)


def _levels(power: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Levels of the cells' powers: 255 for the largest, 0 below 2⁻³⁰ of the largest."""
    most = power.max(initial=0.0)
    if most == 0.0:
        return np.zeros(power.shape, np.uint8)
    largest = float(density_of(np.uint8(255)))
    bits = (power * (largest / most)).astype(np.float32).view(np.uint32)
    levels = ((bits >> (SHIFT - 1)) + 1) >> 1
    return np.where(levels < 8, 0, np.minimum(levels, 255)).astype(np.uint8)  # normal numbers only


def density_of(levels: NDArray[np.uint8] | np.uint8) -> NDArray[np.float64]:
    """Density of a cell for its level, in no particular unit."""
    return (np.asarray(levels, np.uint32) << SHIFT).view(np.float32).astype(float)


def band_shares(band: int, bands: int) -> NDArray[np.float64]:
    """Return a few κ of a band, as shares of the largest."""
    shares = BANDED * (band + 0.5) / bands + _SPREAD * np.linspace(-0.75, 0.75, _KAPPAS)
    return np.asarray(np.clip(shares, 0.02, 1.0), np.float64)


def _cell_power(
    table: DiffractionTable, matrices: list[scipy.sparse.csr_array], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean window sum in each cell (ny, nx) at shares of κ_max, without order 0."""
    expansion = table.expansion
    kappas = shares * expansion.kappa_max
    intervals = expansion.interval(kappas)
    weights = expansion.weights(kappas) / table.scale
    total: NDArray[np.float64] = np.zeros(())
    for interval in np.unique(intervals):
        in_interval = weights[intervals == interval]
        coefficients = table.coefficients[interval].astype(np.float32)
        if expansion.kind == "power":  # linear: the mean of the weights does
            power = series_sum(coefficients[:, :, 0], in_interval.sum(axis=0).astype(np.float32))
            total = total + apply_window(matrices, np.maximum(power, 0.0))
            continue
        for weight in in_interval.astype(np.float32):
            parts = series_sum(coefficients, weight)
            if table.grid.coherent:
                amplitude = parts[..., 0] + 1j * parts[..., 1]
                total = total + np.abs(apply_window(matrices, amplitude)) ** 2
            else:
                total = total + apply_window(matrices, expansion.power_of(parts))
    return np.asarray(total, float)


def _cell_matrix(
    table: DiffractionTable, axis: int, origin: float, cell: float, count: int
) -> scipy.sparse.csr_array:
    """Sparse (cells, bins): the window around a bin, integrated over a cell.

    Amplitudes are taken at the cell's centre instead: as their square is tabulated.
    """
    last, spacing = table.grid.last[axis], table.spacing[axis]
    frequency = spacing * np.arange(-last, last + 1)
    lower = origin + cell * np.arange(count)
    if table.grid.coherent:
        distance = lower[:, None] + 0.5 * cell - frequency
        weights = np.exp(-0.5 * (table.sigma * distance) ** 2)
    else:
        low = scipy.special.erf(table.sigma * (lower[:, None] - frequency))
        high = scipy.special.erf(table.sigma * (lower[:, None] + cell - frequency))
        weights = high - low
    weights[weights < 1e-7] = 0.0
    return scipy.sparse.csr_array(weights.astype(np.float32))


def cumulative(power: NDArray[np.float64]) -> NDArray[np.float32]:
    """Running sums along the last axis, from exactly 0 to exactly 1; 0 where there is none."""
    sums = np.cumsum(power, axis=-1)
    total = sums[..., -1:]
    result = np.zeros((*power.shape[:-1], power.shape[-1] + 1), np.float32)
    np.divide(sums, total, out=result[..., 1:], where=total > 0.0, casting="same_kind")
    return result
