"""Error of a table against the exact DFT: the error measure of the whole project.

At every bin that light can reach, moved by up to half a bin (fixed seed), the table's ⟨|P|²⟩ is
compared with the exact one, over κ between the nodes of the series and at its ends:

    error = Σ |table − exact| / Σ exact     at the worst κ,

taps, series and storage included. The bins within 3/σ of order 0 (the glossy reflection) and all
others (the colours) are sums of their own, since one may outweigh the other a thousandfold. A
grating can put out either part at one κ altogether; there the sum is compared with a thousandth
of the largest value that this part has at any κ.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..expansion import Expansion, series_sum
from ..layout import Grid
from ..window import apply_window, tap_matrix
from .powers import PatchSpectra
from .spectrum import GLOSSY_RADIUS

#: A part that vanishes at some κ is compared with this share of its largest value.
FLOOR = 1e-3

#: Units of 1/σ from a bin within which its lobe is looked at: 1/e⁴ of its power at the edge.
_WITHIN = 2.0
_SEED = 20140113
_SMALL = 1 << 16  # coefficients
_TOGETHER = 10  # κ whose series are summed at once: widening half floats takes longer than the sum

Parts = NDArray[np.float64]  # [[|error| near, |error| far], [exact near, exact far]]


class ErrorMeter:
    """Compares a table with the exact DFT of the same heights, one κ at a time.

    Several spectra are of several patches, whose powers are averaged.
    """

    def __init__(self, spectra: PatchSpectra, grid: Grid, expansion: Expansion) -> None:
        self.spectra, self.grid, self.expansion = spectra, grid, expansion
        self._real: Any = np.float64 if spectra.double else np.float32
        self._outer = spectra.last
        rng = np.random.default_rng(_SEED)
        axes = []
        self._lobe: list[NDArray[Any]] = []
        self._wide: list[scipy.sparse.csr_array] = []
        tapped: list[list[scipy.sparse.csr_array]] = []
        rows: dict[range, list[int]] = {}  # by the columns that are read
        for row, columns in enumerate(grid.tapped()):
            rows.setdefault(columns, []).append(row)
        for axis in (0, 1):
            outer = min(int(grid.radius[axis]), spectra.last[axis])
            bins = np.arange(-outer, outer + 1)
            # Bins of a short period are far apart: half-way between them there is no light at all
            most = min(0.5, _WITHIN / grid.steps[axis])
            positions = bins + rng.uniform(-most, most, len(bins))
            exponent, last = grid.exponents[axis], grid.last[axis]
            wide = tap_matrix(
                positions, -spectra.last[axis], spectra.shape[1 - axis], exponent, None
            )
            few = [
                tap_matrix(positions, -last, 2 * last + 1, exponent, grid.taps[axis], numbers)
                for numbers in (rows if axis == 0 else rows.values())
            ]
            self._wide.append(wide.astype(self._real))
            tapped.append([matrix.astype(self._real) for matrix in few])
            self._lobe.append(np.exp(-exponent * positions**2).astype(self._real))
            axes.append(bins)
        self._tapped = list(zip(*tapped, strict=True))
        x, y = np.meshgrid(axes[0], axes[1])
        reached = (x / grid.radius[0]) ** 2 + (y / grid.radius[1]) ** 2 <= 1.0
        self._near = reached & (np.hypot(x * grid.steps[0], y * grid.steps[1]) <= GLOSSY_RADIUS)
        self._far = reached & ~self._near

    def series(
        self,
        coefficients: NDArray[np.floating],
        order_0: NDArray[np.float64],
        kappas: NDArray[np.float64],
        scale: float = 1.0,
    ) -> Iterator[Parts]:
        """Parts of the stored table at one κ after the other, all of one interval.

        Parameters
        ----------
        coefficients : (ny, nx, components, terms), of the interval.
        order_0 : (components, series_terms), likewise.
        kappas : (n,), rad/µm.
        scale : what `coefficients` were multiplied with.
        """
        weights = self.expansion.weights(kappas).astype(self._real)
        centres = self.expansion.series_weights(kappas) @ order_0.T
        centres[:, 0] += self.expansion.order_0_offset(self.expansion.interval(kappas))
        exact = self._exact(kappas.tolist())
        for start in range(0, len(kappas), _TOGETHER):
            few = slice(start, start + _TOGETHER)
            tables = self._tables(coefficients, weights[few] / self._real(scale))
            for centre, table in zip(centres[few], tables, strict=True):
                if self.expansion.kind == "power":
                    yield self._compare(next(exact), table[..., 0], centre[0])
                else:
                    bins = table[..., 0] + 1j * table[..., 1]
                    yield self._compare(next(exact), bins, complex(*centre))

    def _tables(
        self, coefficients: NDArray[np.floating], weights: NDArray[np.floating]
    ) -> NDArray[np.floating]:
        """Series (n, ny, nx, components) with weights (n, terms): each coefficient is read once."""
        if coefficients.size < _SMALL:  # threads would take longer to start
            return series_sum(coefficients.astype(self._real), weights)
        result = np.empty((len(weights), *coefficients.shape[:3]), self._real)

        def sum_row(y: int) -> None:
            result[:, y] = series_sum(coefficients[y].astype(self._real), weights)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(sum_row, range(len(coefficients))))
        return result

    def taps_alone(self, kappa: float) -> Parts:
        """Error parts due to the taps alone, as if series and storage were exact."""
        (exact,) = self._exact([kappa])
        (y, x), (last_y, last_x) = self._outer[::-1], self.grid.last[::-1]
        inner = exact[y - last_y : y + last_y + 1, x - last_x : x + last_x + 1].copy()
        centre = inner[last_y, last_x]
        inner[last_y, last_x] = 0.0
        return self._compare(exact, inner, complex(centre))

    def _exact(self, kappas: Sequence[float]) -> Iterator[NDArray[Any]]:
        """Exact |a_j|², mean over the patches; for amplitudes, a_j of the only patch."""
        middle = self._outer[1], self._outer[0]
        if self.expansion.kind == "power":
            for power in self.spectra.powers(kappas):
                bins = power.bins.astype(self._real, copy=False)
                bins[middle] = power.order_0
                yield bins
            return
        for kappa in kappas:
            amplitude = self.spectra.amplitudes(kappa, self.grid.coherent)
            amplitude[middle] += 1.0
            yield amplitude

    def _tap(self, table: NDArray[Any]) -> NDArray[Any]:
        """Sum over a look-up's taps, without order 0."""
        total: Any = 0.0
        for matrices in self._tapped:
            total = total + apply_window(matrices, table)
        return total

    def _compare(self, exact: NDArray[Any], table: NDArray[Any], centre: complex) -> Parts:
        """Sums over the bins, of a table without order 0 and of the whole lobe of `centre`."""
        lobe = np.outer(self._lobe[1], self._lobe[0])
        if self.grid.coherent:
            truth = _power(apply_window(self._wide, exact))
            approximate = _power(self._tap(table) + centre * lobe)
        else:
            if self.expansion.kind == "amplitude":
                exact, table, centre = _power(exact), _power(table), abs(centre) ** 2
            # sharpened powers of windows dip below zero between strong orders
            truth = np.maximum(apply_window(self._wide, exact), 0.0)
            approximate = np.maximum(self._tap(table) + centre.real * lobe, 0.0)
        difference = np.abs(approximate - truth)
        return np.array(
            [
                [difference[self._near].sum(dtype=float), difference[self._far].sum(dtype=float)],
                [truth[self._near].sum(dtype=float), truth[self._far].sum(dtype=float)],
            ]
        )


def worst(kappas: Sequence[float], parts: Sequence[Parts]) -> dict[str, float]:
    """The measure of the project, from the parts at many κ.

    Returns
    -------
    dict with `near` and `far`, relative errors, and `kappa_near`, `kappa_far`, rad/µm, where.
    """
    error, exact = np.array(parts)[:, 0], np.array(parts)[:, 1]
    floor = FLOOR * exact.max(axis=0)
    scale = np.maximum(exact, floor)
    ratio = np.divide(error, scale, out=np.zeros_like(error), where=scale > 0)
    where = ratio.argmax(axis=0)
    return {
        "near": float(ratio[where[0], 0]),
        "far": float(ratio[where[1], 1]),
        "kappa_near": float(kappas[where[0]]),
        "kappa_far": float(kappas[where[1]]),
    }


def _power(amplitude: NDArray[Any]) -> NDArray[np.floating]:
    return amplitude.real**2 + amplitude.imag**2
