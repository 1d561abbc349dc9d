"""r of a table's patches on a grid: what tells hills from pits (`optics.second_order`).

Cells hold many orders, whose r is averaged by power: what all windows on a surface have in common,
not the speckle of one. Of a short period, whose orders are few, each cell is one order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ...heights.field import HeightField
from ...optics.second_order import SlopeRatios, Slopes, along
from ...settings import TableSettings
from ..table import q_limit_of
from .describe import sections

#: Width of a cell, nodes of κ and the first of them, in units of `q_limit`.
CELL, STEP, FIRST = 1 / 14, 1 / 4, 1 / 24
#: Least light in a cell that has an r: less is single precision's.
LEAST = 1e-12
#: Of r times its gate: more adds `second_order.LIMIT` in any case.
MOST = 100.0

Complex = NDArray[np.complex64]


def slope_ratios(patches: Sequence[HeightField], settings: TableSettings) -> SlopeRatios:
    """r of patches, as far as the table has orders; four transforms for each node of κ."""
    q_limit = q_limit_of(settings.wavelength_range)
    reach = tuple(min(q, q_limit) for q in settings.q_max or (q_limit, q_limit))
    first, last = q_limit * FIRST, q_limit * settings.height_scale_max
    last = max(2.0 * first, min(last, settings.kappa_max or last))
    nodes = np.linspace(first, last, 2 + math.floor((last - first) / (q_limit * STEP)))
    spacing = [2.0 * np.pi / length for length in next(sections(patches))[0].extent]
    few = [step >= 0.5 * CELL * q_limit for step in spacing]
    cell = [step if own else CELL * q_limit for own, step in zip(few, spacing, strict=True)]
    middle = [math.ceil(q / width) + 1 for q, width in zip(reach, cell, strict=True)]
    shape = 2 * middle[1] + 1, 2 * middle[0] + 1
    sums = np.zeros((len(nodes), shape[0] * shape[1], 3), np.complex64)
    gates = []
    for patch, taper in sections(patches):
        slopes = Slopes.of(patch.heights, patch.pixel_size, taper**2)
        gates.append(slopes.gate)
        q, which = _orders(patch, reach)
        within = _weights(q / cell + middle, shape)
        for found, kappa in zip(sums, nodes, strict=True):
            a, *products = (s.ravel()[which] for s in _spectra(patch, slopes, taper, kappa))
            squares = along(q, np.stack(products, axis=-1)) * a.conj()[:, None]
            found += within @ np.column_stack([np.abs(a) ** 2, squares])
    power = sums[..., :1].real
    ratios = np.divide(sums[..., 1:], power, out=np.zeros_like(sums[..., 1:]), where=power > LEAST)
    ratios *= np.mean(gates)
    ratios /= np.maximum(1.0, np.abs(ratios) / MOST)
    values = np.moveaxis(ratios, -1, 1).reshape(len(nodes), 2, *shape)
    halves = np.ascontiguousarray(values).view(np.float32).astype(np.float16).astype(np.float32)
    return SlopeRatios(
        (cell[0], cell[1]), (few[0], few[1]), (first, last), halves.view(np.complex64)
    )


def _spectra(
    patch: HeightField, slopes: Slopes, taper: NDArray[np.float64], kappa: float
) -> Iterator[Complex]:
    """Of exp(−iκh), and of it times each of the slopes' products, without their means."""
    screen = np.exp(-1j * np.asarray(kappa * patch.heights, np.float32))
    for factor in (1.0, *slopes.products.astype(np.float32)):
        one = screen * factor
        one = (one - one.mean()) * taper.astype(np.float32)
        yield scipy.fft.fft2(one, norm="forward", overwrite_x=True)


def _orders(
    patch: HeightField, reach: tuple[float, ...]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Frequencies (n, 2) of all orders but order 0 within these half axes; their places."""
    ny, nx = patch.shape
    dx, dy = patch.pixel_size
    qx, qy = (2.0 * np.pi * np.fft.fftfreq(n, d) for n, d in ((nx, dx), (ny, dy)))
    length = np.hypot(qx / reach[0], qy[:, None] / reach[1])
    y, x = np.nonzero((length > 0.0) & (length <= 1.0))
    return np.column_stack([qx[x], qy[y]]), y * nx + x


def _weights(places: NDArray[np.float64], shape: tuple[int, int]) -> csr_array:
    """(cells, orders): what each order at (x, y), in cells, gives to the four about it."""
    lower = np.floor(places + 1e-6).astype(np.int64)
    upper = np.clip(places - lower, 0.0, 1.0)
    rows, weights = [], []
    for x, y in np.ndindex(2, 2):
        share = np.abs(1 - x - upper[:, 0]) * np.abs(1 - y - upper[:, 1])
        rows.append((lower[:, 1] + y) * shape[1] + lower[:, 0] + x)
        weights.append(share.astype(np.float32))
    columns = np.tile(np.arange(len(places)), 4)
    entries = np.concatenate(weights), (np.concatenate(rows), columns)
    return csr_array(entries, shape=(shape[0] * shape[1], len(places)))
