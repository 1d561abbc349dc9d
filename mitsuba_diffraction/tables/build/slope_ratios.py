"""r of a table's patches on a grid: what tells hills from pits (`optics.second_order`).

Cells hold many orders, whose r is averaged by power: what all windows on a surface have in common,
not the speckle of one. Of a short period, whose orders are few, each cell is one order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from ...heights.field import HeightField
from ...optics.second_order import SlopeRatios, Slopes
from ...settings import TableSettings
from ..table import q_limit_of
from .describe import sections

#: Width of a cell, nodes of κ and the first of them, in units of `q_limit`.
CELL, STEP, FIRST = 1 / 14, 1 / 4, 1 / 24
#: Nodes of κ where a cell is one order, whose r has poles in κ.
STEP_OF_ORDERS = 1 / 12
#: Between transforms, at most this in units of 1/RMS height: r κ is straight there, as r goes with
#: 1/κ where κ is small. What powers are multiplied by changes by less than 0.3 % on average.
BETWEEN = 0.8
#: Least light in a cell that has an r: less is single precision's.
LEAST = 1e-12
#: Of r times its gate: more adds `second_order.LIMIT` in any case.
MOST = 100.0

Complex = NDArray[np.complex64]
Floats = NDArray[np.float32]
Real = NDArray[np.float64]


def slope_ratios(patches: Sequence[HeightField], settings: TableSettings) -> SlopeRatios:
    """r of patches, as far as the table has orders; four transforms for each κ that is summed."""
    q_limit = q_limit_of(settings.wavelength_range)
    reach = tuple(min(q, q_limit) for q in settings.frequency_limit or (q_limit, q_limit))
    first, last = q_limit * FIRST, q_limit * settings.height_scale_max
    last = max(2.0 * first, last)
    spacing = [2.0 * np.pi / length for length in next(sections(patches))[0].extent]
    few = [step >= 0.5 * CELL * q_limit for step in spacing]
    cell = [step if own else CELL * q_limit for own, step in zip(few, spacing, strict=True)]
    middle = [math.ceil(q / width) + 1 for q, width in zip(reach, cell, strict=True)]
    step = q_limit * (STEP_OF_ORDERS if any(few) else STEP)
    nodes = np.linspace(first, last, 2 + math.floor((last - first) / step))
    count = 2 + math.floor((last - first) * max(p.rms_height for p in patches) / BETWEEN)
    summed = nodes if any(few) else np.linspace(first, last, min(count, len(nodes)))
    sums, gate = _sums(patches, summed, reach, cell, middle)
    power = sums[:, :1].real
    ratios = np.divide(sums[:, 1:], power, out=np.zeros_like(sums[:, 1:]), where=power > LEAST)
    ratios *= gate
    ratios /= np.maximum(1.0, np.abs(ratios) / MOST)
    if len(summed) < len(nodes):
        straight = interp1d(summed, summed[:, None, None, None] * ratios, axis=0)
        ratios = straight(nodes) / nodes[:, None, None, None]
    halves = np.ascontiguousarray(ratios, np.complex64).view(np.float32).astype(np.float16)
    values = halves.astype(np.float32).view(np.complex64)
    return SlopeRatios((cell[0], cell[1]), (few[0], few[1]), (first, last), values)


def _sums(
    patches: Sequence[HeightField],
    nodes: Real,
    reach: Sequence[float],
    cell: Sequence[float],
    middle: Sequence[int],
) -> tuple[Complex, float]:
    """Σ|a|², Σ a* D_l and Σ a* D_t of cells at each κ, (κ, 3, ny, nx); the mean gate."""
    sums = np.zeros((len(nodes), 3, 2 * middle[1] + 1, 2 * middle[0] + 1), np.complex64)
    gates = []
    for patch, taper in sections(patches):
        slopes = Slopes.of(patch.heights, patch.pixel_size, taper**2)
        gates.append(slopes.gate)
        factors, orders = slopes.products.astype(np.float32), _Orders.of(patch, reach)
        del slopes  # as much memory again
        x, y = (_tents(q / w, m) for q, w, m in zip(orders.q, cell, middle, strict=True))
        for found, kappa in zip(sums, nodes, strict=True):
            a, *products = _spectra(patch, factors, taper, kappa, orders)
            for mine, one in zip(found, orders.powers(a, products), strict=True):
                mine += y @ one @ x.T
    return sums, float(np.mean(gates))


@dataclass(frozen=True)
class _Orders:
    """The orders within half axes of an ellipse, but order 0, on the rectangle about it.

    Attributes
    ----------
    q : along x and y, (nx,) and (ny,), rad/µm.
    places : of them in a transform.
    inside : 1 or 0, (ny, nx).
    """

    q: tuple[Real, Real]
    places: tuple[NDArray[np.int64], NDArray[np.int64]]
    inside: Floats

    @classmethod
    def of(cls, patch: HeightField, reach: Sequence[float]) -> _Orders:
        every = [
            2.0 * np.pi * np.fft.fftfreq(n, d)
            for n, d in zip(patch.shape[::-1], patch.pixel_size, strict=True)
        ]
        x, y = (np.flatnonzero(np.abs(q) <= r) for q, r in zip(every, reach, strict=True))
        qx, qy = (np.asarray(q[n], np.float64) for q, n in zip(every, (x, y), strict=True))
        squares = (qx / reach[0]) ** 2 + (qy[:, None] / reach[1]) ** 2
        inside = (squares > 0.0) & (squares <= 1.0)
        return cls((qx, qy), (x, y), inside.astype(np.float32))

    def powers(self, a: Complex, products: Sequence[Complex]) -> Iterator[Complex]:
        """|a|², a* D_l and a* D_t, (ny, nx), of spectra there."""
        conjugate = a.conj() * self.inside
        xx, xy, yy = products
        qx, qy = (q.astype(np.float32) for q in (self.q[0], self.q[1][:, None]))
        squares = np.maximum(qx * qx + qy * qy, np.float32(1e-20))
        length = (qx * qx * xx + 2.0 * qx * qy * xy + qy * qy * yy) / squares
        yield conjugate * a
        yield conjugate * length
        yield conjugate * (xx + yy - length)


def _spectra(
    patch: HeightField, products: Floats, taper: Real, kappa: float, orders: _Orders
) -> Iterator[Complex]:
    """Of exp(−iκh), and of it times each of the slopes' products, without their means if it fades.

    Rows of the plane that no order is in are not transformed along y.
    """
    phase, x, y = np.asarray(-kappa * patch.heights, np.float32), *orders.places
    screen = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=screen.real)  # five times as fast as exp
    np.sin(phase, out=screen.imag)
    for factor in (np.float32(1.0), *products):
        one = screen * factor
        if taper.size > 1:  # else means are order 0's alone
            one = (one - one.mean()) * taper.astype(np.float32)
        rows = scipy.fft.fft(one, axis=1, norm="forward", overwrite_x=True)[:, x]
        yield scipy.fft.fft(rows, axis=0, norm="forward", overwrite_x=True)[y]


def _tents(places: Real, middle: int) -> Floats:
    """(cells, orders): what each order, at places in cells, gives to the two about it."""
    cells = np.arange(-middle, middle + 1)[:, None]
    return np.maximum(0.0, 1.0 - np.abs(places - cells)).astype(np.float32)
