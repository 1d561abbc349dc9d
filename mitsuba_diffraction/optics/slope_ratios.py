"""Slope ratios r of a surface: the heights' part of the second order of small slope (NumPy).

With l along an order's spatial frequency q and t across it,

    r_l = a D_l* / |a|²,   a the spectrum of exp(iκh),   D_l the spectrum of (∂_l h)² exp(iκh),

and r_t likewise, with a and D in the signs of eq. (2): means of exp(i q·r) times the function. The
transforms here are of exp(−iκh) with exp(−i q·r), complex conjugates of both, so that the code has
a* D. The ratios distinguish hills from pits, which the power |a|² does not. Many orders
share a cell of q, whose r is Σ a D* / Σ |a|²: the part that all windows on a surface have in
common, without the speckle of one of them. Where a period is short each cell is one order. Order 0
has no ratio: it keeps the power of the first order.

Slopes are measured on the surface filtered by 1/(1 + (q/23)²), q in rad/µm: finer structure
diffracts light into waves that do not travel. At vertical walls the filter removes most of the
slope variance; there r is multiplied by the gate G = ρ²/(ρ² + 0.01), with ρ the fraction that
remains."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..heights.field import HeightField

#: Spatial frequency, rad/µm, at which slopes are filtered: that of green light at grazing angles.
SLOPE_CUTOFF = 23.0
# Remaining fraction ρ of the slope variance at which the gate is half open
_HALF = 0.1
#: Width of a cell, spacing of the κ nodes and the first node, in units of the largest q.
CELL, STEP, FIRST = 1 / 14, 1 / 4, 1 / 24
#: Spacing of the κ nodes where a cell is one order, whose r has poles in κ.
STEP_OF_ORDERS = 1 / 12
#: Largest distance in κ between transforms, in units of 1/RMS height. In between r κ is nearly
#: linear in κ; the error of the factors on powers is below 0.3 % on average.
BETWEEN = 0.8
#: Least power in a cell that has a ratio: less is rounding in single precision.
MIN_CELL_POWER = 1e-12
#: Finer cells along each axis of a cell that holds many orders, for `CellSums.fine_power`.
FINER = 3
#: Largest |r| times the gate: any larger one reaches `second_order.LIMIT`.
MAX_RATIO = 100.0

Single = NDArray[np.complex64]
Complex = NDArray[np.complex128]
Floats = NDArray[np.float32]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class Slopes:
    """Products of the filtered slopes, (3, ny, nx): xx, xy, yy; and the gate, 0 to 1."""

    products: Real
    gate: float

    @classmethod
    def from_heights(
        cls, heights: ArrayLike, pixel_size: tuple[float, float], weight: Real | float = 1.0
    ) -> Slopes:
        """Return the products for heights (ny, nx) in µm.

        weight : of each point in the slope variances that decide the gate.
        """
        surface = np.asarray(heights, np.float64)
        qx, qy = (_frequencies(n, d) for n, d in zip(surface.shape[::-1], pixel_size, strict=True))
        spectrum = scipy.fft.rfft2(surface)
        qx, qy = qx[: spectrum.shape[1]], qy[:, None]

        def slope(q: Real) -> Real:
            return np.asarray(scipy.fft.irfft2(1j * q * spectrum, surface.shape, overwrite_x=True))

        every = sum(float(np.mean(slope(q) ** 2 * weight)) for q in (qx, qy))
        spectrum /= 1.0 + (qx**2 + qy**2) / SLOPE_CUTOFF**2
        x, y = slope(qx), slope(qy)
        left = float(np.mean((x**2 + y**2) * weight)) / every if every > 0.0 else 1.0
        return cls(np.stack([x * x, x * y, y * y]), left**2 / (left**2 + _HALF**2))


def _frequencies(count: int, pixel: float) -> Real:
    """Frequencies of a transform, rad/µm; Nyquist's is 0, since its slope is 0 at the points."""
    frequencies = np.asarray(2.0 * np.pi * np.fft.fftfreq(count, pixel), np.float64)
    if count % 2 == 0:
        frequencies[count // 2] = 0.0
    return frequencies


def along(q: Real, spectra: Complex) -> Complex:
    """D_l, D_t (..., 2) from spectra (..., 3) of the products; q (..., 2) must not be 0."""
    x, y = np.moveaxis(q, -1, 0) / np.hypot(q[..., 0], q[..., 1])
    xx, xy, yy = np.moveaxis(spectra, -1, 0)
    lengthwise = x * x * xx + 2.0 * x * y * xy + y * y * yy
    return np.stack([lengthwise, xx + yy - lengthwise], axis=-1)


@dataclass(frozen=True, eq=False)
class SlopeRatios:
    """Ratios r of a surface, times the gate, on a grid of q and κ; linear between nodes.

    Attributes
    ----------
    cell : (dqx, dqy), rad/µm.
    orders : whether a cell is one order, along x and y; q is then rounded to it.
    kappa : first and last κ, rad/µm, evenly between; beyond them r is taken at the nearest.
    values : (n, 2, ny, nx) complex, l and t; q = 0 is in the middle.
    change : relative change of the colours by the second order (`second_order_change`).
    """

    cell: tuple[float, float]
    orders: tuple[bool, bool]
    kappa: tuple[float, float]
    values: NDArray[np.complexfloating]
    change: float

    @property
    def middle(self) -> tuple[int, int]:
        """Index of q = 0, along x and y."""
        _, _, ny, nx = self.values.shape
        return nx // 2, ny // 2

    def at(self, q: ArrayLike, kappa: ArrayLike) -> Complex:
        """r_l, r_t (..., 2) at q (..., 2) and κ (...), both in rad/µm."""
        cells, count = np.asarray(q, np.float64) / self.cell + self.middle, len(self.values)
        cells = np.where(self.orders, np.round(cells), cells)
        low, high = self.kappa
        depth = (np.asarray(kappa, np.float64) - low) / (high - low) * (count - 1)
        coordinates = np.stack(np.broadcast_arrays(depth, cells[..., 1], cells[..., 0]))
        ratios = [
            scipy.ndimage.map_coordinates(part, coordinates.reshape(3, -1), order=1, mode="nearest")
            for part in (self.values[:, 0], self.values[:, 1])
        ]
        return np.stack(ratios, axis=-1).reshape(*coordinates.shape[1:], 2).astype(complex)


@dataclass(frozen=True, eq=False)
class CellGrid:
    """Cells of q, and values of κ, over which sums are taken.

    Attributes
    ----------
    reach : largest q along x and y, half axes of an ellipse, rad/µm.
    cell, orders : as in `SlopeRatios`.
    middle : index of q = 0 along x and y.
    nodes : (n,) κ at which r is tabulated, rad/µm.
    summed : (m,) κ at which transforms are made; r κ is interpolated linearly between them.
    """

    reach: tuple[float, float]
    cell: tuple[float, float]
    orders: tuple[bool, bool]
    middle: tuple[int, int]
    nodes: Real
    summed: Real

    @classmethod
    def for_patches(
        cls,
        extent: tuple[float, float],
        rms_height: float,
        q_limit: float,
        reach: tuple[float, float] | None = None,
        kappa_max: float | None = None,
    ) -> CellGrid:
        """Choose the grid for patches of this extent and RMS height, both in µm.

        q_limit : largest q that light of the shortest wavelength probes, rad/µm.
        reach : largest q along x and y that is looked up, rad/µm; None for `q_limit`.
        kappa_max : largest κ that is looked up, rad/µm; None for `q_limit`.
        """
        reach = reach or (q_limit, q_limit)
        first = q_limit * FIRST
        last = max(2.0 * first, kappa_max or q_limit)
        spacing = [2.0 * np.pi / length for length in extent]
        orders = [step >= 0.5 * CELL * q_limit for step in spacing]
        cell = [
            step if alone else CELL * q_limit for alone, step in zip(orders, spacing, strict=True)
        ]
        middle = [math.ceil(q / width) + 1 for q, width in zip(reach, cell, strict=True)]
        step = q_limit * (STEP_OF_ORDERS if any(orders) else STEP)
        nodes = np.linspace(first, last, 2 + math.floor((last - first) / step))
        count = 2 + math.floor((last - first) * rms_height / BETWEEN)
        few = not any(orders) and count < len(nodes)
        return cls(
            reach,
            (cell[0], cell[1]),
            (orders[0], orders[1]),
            (middle[0], middle[1]),
            nodes,
            np.linspace(first, last, count) if few else nodes,
        )

    @property
    def fine_frequencies(self) -> tuple[Real, Real]:
        """Centres of the finer cells along x and y, rad/µm."""
        x, y = (
            np.arange(-middle * n, middle * n + 1) * width / n
            for middle, width, n in (
                (middle, width, 1 if alone else FINER)
                for middle, width, alone in zip(self.middle, self.cell, self.orders, strict=True)
            )
        )
        return x, y


@dataclass(frozen=True, eq=False)
class CellSums:
    """Sums over the orders in each cell, at each κ of `grid.summed`.

    Attributes
    ----------
    power : (m, ny, nx) Σ|a|², without order 0.
    products : (m, 2, ny, nx) Σ a* D_l and Σ a* D_t.
    fine_power : (m, ny', nx') Σ|a|² in the cells of `grid.fine_frequencies`.
    gate : mean gate of the patches.
    """

    grid: CellGrid
    power: Floats
    products: Single
    fine_power: Floats
    gate: float

    @classmethod
    def of_patches(cls, patches: Iterable[tuple[HeightField, Real]], grid: CellGrid) -> CellSums:
        """Add up patches, each with the taper of its screens; four transforms a patch and κ."""
        (middle_x, middle_y), nodes = grid.middle, grid.summed
        sums = np.zeros((len(nodes), 3, 2 * middle_y + 1, 2 * middle_x + 1), np.complex64)
        finer = [1 if alone else FINER for alone in grid.orders]
        fine_y, fine_x = (len(q) for q in grid.fine_frequencies[::-1])
        fine = np.zeros((len(nodes), fine_y, fine_x), np.float32)
        gates = []
        for patch, taper in patches:
            slopes = Slopes.from_heights(patch.heights, patch.pixel_size, taper**2)
            gates.append(slopes.gate)
            factors, orders = slopes.products.astype(np.float32), _Orders.within(patch, grid.reach)
            del slopes  # as large as the transforms' working memory
            x, y = (
                _tents(q / w, m) for q, w, m in zip(orders.q, grid.cell, grid.middle, strict=True)
            )
            narrow_x, narrow_y = (
                _tents(q / w * n, m * n)
                for q, w, m, n in zip(orders.q, grid.cell, grid.middle, finer, strict=True)
            )
            for total, powers, kappa in zip(sums, fine, nodes, strict=True):
                a, *products = _spectra(patch, factors, taper, kappa, orders)
                for cells, product in zip(total, orders.products(a, products), strict=True):
                    cells += y @ product @ x.T
                powers += narrow_y @ (orders.inside * np.abs(a) ** 2) @ narrow_x.T
        power = np.ascontiguousarray(sums[:, 0].real)
        return cls(grid, power, sums[:, 1:], fine, float(np.mean(gates)))

    def ratios(self) -> SlopeRatios:
        """Return r times the gate at all nodes, rounded to half floats; `change` is NaN."""
        summed, nodes = self.grid.summed, self.grid.nodes
        power = self.power[:, None]
        ratios = np.divide(
            self.products, power, out=np.zeros_like(self.products), where=power > MIN_CELL_POWER
        )
        ratios *= self.gate
        ratios /= np.maximum(1.0, np.abs(ratios) / MAX_RATIO)
        if summed is not nodes:
            linear = scipy.interpolate.interp1d(
                summed, summed[:, None, None, None] * ratios, axis=0
            )
            ratios = linear(nodes) / nodes[:, None, None, None]
        halves = np.ascontiguousarray(ratios, np.complex64).view(np.float32).astype(np.float16)
        values = halves.astype(np.float32).view(np.complex64)
        kappa = float(nodes[0]), float(nodes[-1])
        return SlopeRatios(self.grid.cell, self.grid.orders, kappa, values, math.nan)


@dataclass(frozen=True)
class _Orders:
    """Orders in an ellipse about order 0, on the rectangle around it.

    Attributes
    ----------
    q : along x and y, (nx,) and (ny,), rad/µm.
    indices : of the orders in a transform, along x and y.
    inside : 1 in the ellipse, 0 outside of it and at order 0, (ny, nx).
    """

    q: tuple[Real, Real]
    indices: tuple[NDArray[np.int64], NDArray[np.int64]]
    inside: Floats

    @classmethod
    def within(cls, patch: HeightField, reach: Sequence[float]) -> _Orders:
        every = [
            2.0 * np.pi * np.fft.fftfreq(n, d)
            for n, d in zip(patch.shape[::-1], patch.pixel_size, strict=True)
        ]
        x, y = (np.flatnonzero(np.abs(q) <= r) for q, r in zip(every, reach, strict=True))
        qx, qy = (np.asarray(q[n], np.float64) for q, n in zip(every, (x, y), strict=True))
        squares = (qx / reach[0]) ** 2 + (qy[:, None] / reach[1]) ** 2
        inside = (squares > 0.0) & (squares <= 1.0)
        return cls((qx, qy), (x, y), inside.astype(np.float32))

    def products(self, a: Single, spectra: Sequence[Single]) -> Iterator[Single]:
        """|a|², a* D_l and a* D_t, (ny, nx), from a and the spectra of the slopes' products."""
        conjugate = a.conj() * self.inside
        xx, xy, yy = spectra
        qx, qy = (q.astype(np.float32) for q in (self.q[0], self.q[1][:, None]))
        squares = np.maximum(qx * qx + qy * qy, np.float32(1e-20))
        lengthwise = (qx * qx * xx + 2.0 * qx * qy * xy + qy * qy * yy) / squares
        yield conjugate * a
        yield conjugate * lengthwise
        yield conjugate * (xx + yy - lengthwise)


def _spectra(
    patch: HeightField, products: Floats, taper: Real, kappa: float, orders: _Orders
) -> Iterator[Single]:
    """Spectra of exp(−iκh) and of exp(−iκh) times each of the slopes' products.

    Tapered screens lose their means first. Rows of the plane without orders are not transformed
    along y.
    """
    phase, (x, y) = np.asarray(-kappa * patch.heights, np.float32), orders.indices
    screen = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=screen.real)  # five times as fast as exp
    np.sin(phase, out=screen.imag)
    for factor in (np.float32(1.0), *products):
        function = screen * factor
        if taper.size > 1:  # without a taper the mean is in order 0 alone
            function = (function - function.mean()) * taper.astype(np.float32)
        rows = scipy.fft.fft(function, axis=1, norm="forward", overwrite_x=True)[:, x]
        yield scipy.fft.fft(rows, axis=0, norm="forward", overwrite_x=True)[y]


def _tents(coordinates: Real, middle: int) -> Floats:
    """Weights (cells, orders) of each order, at coordinates in cells, in the two cells about it."""
    cells = np.arange(-middle, middle + 1)[:, None]
    return np.maximum(0.0, 1.0 - np.abs(coordinates - cells)).astype(np.float32)
