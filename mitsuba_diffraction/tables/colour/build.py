"""Building a colour table: the integral over wavelengths, as a correlation in log radius.

What light of wavelength λ sees at (u, v, z) are the spatial frequency q = 2π(u, v)/λ and the phase
per height κ = 2πz/λ, z = w·height_scale. In polar coordinates, with G_t(ln|q|, φ) the window sum of
term t of the table's series in κ and b_t that term's polynomial,

    RGB(r, φ, z) = ∫ Σ_t G_t(ln 2πr − ln λ, φ) b_t(2πz/λ) s̄(λ)/λ² dλ:

G is looked up once on a grid that is even in ln|q| and φ, and every ring of the colour table is
then one matrix product of it with weights that are the same for all rings and azimuths.

Orders are smeared along the radius by the wavelengths and sharp in azimuth only, where a lobe is
1/(σ√2|q|) wide: on rings even in ln r (`PolarGrid`), with azimuths as far apart as a share of that
width, the memory goes where the features are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ...optics.colour import linear_srgb, response
from ..expansion import Expansion, series_sum
from ..powers import as_powers, fitted, order_0_power, power_expansion
from ..table import DiffractionTable
from ..window import taps_at

#: |(u, v)| is at most 2.
LARGEST_RADIUS = 2.0
#: Only grazing light probes larger ones: they get no finer azimuths and wavelengths than this one.
RESOLVED_RADIUS = 1.4


@dataclass(frozen=True)
class PolarGrid:
    """Rings and their azimuths; the bins of a ring are stored one after the other.

    Attributes
    ----------
    smallest : radius of ring 0.
    step : distance of rings in ln r.
    counts : azimuths of each ring, 2ⁿ or 3·2ⁿ; azimuth n of N is at φ = 2πn/N. Every ring repeats
        its first bin at its end, so that a look-up never wraps around.
    """

    smallest: float
    step: float
    counts: tuple[int, ...]

    @classmethod
    def of(cls, lobe: float, step: float, share: float) -> PolarGrid:
        """The grid for lobes of standard deviation `lobe` in (u, v).

        Parameters
        ----------
        lobe : of the narrowest lobes, at short wavelengths.
        step : distance of rings in ln r.
        share : largest distance of azimuths, in units of `lobe`.
        """
        smallest = 0.05 * lobe
        rings = math.ceil(math.log(LARGEST_RADIUS / smallest) / step) + 2
        counts = []
        for ring in range(rings):
            radius = min(smallest * math.exp(step * ring), RESOLVED_RADIUS)
            wanted = 2 * math.pi * radius / (share * lobe)
            power = 1 << max(4, math.ceil(math.log2(wanted)))
            counts.append(3 * power // 4 if 3 * power // 4 >= wanted else power)
        return cls(smallest, step, tuple(counts))

    @property
    def rings(self) -> int:
        """Number of rings."""
        return len(self.counts)

    @property
    def bins(self) -> int:
        """Number of bins, the repeated ones included."""
        return sum(self.counts) + self.rings

    def radius(self, ring: int) -> float:
        """Radius |(u, v)| of a ring."""
        return self.smallest * math.exp(self.step * ring)

    def start(self, ring: int) -> int:
        """Index of the ring's first bin."""
        return sum(self.counts[:ring]) + ring

    def bands(self) -> Iterator[range]:
        """Runs of rings with the same number of azimuths."""
        first = 0
        for ring in range(1, self.rings + 1):
            if ring == self.rings or self.counts[ring] != self.counts[first]:
                yield range(first, ring)
                first = ring


#: Wavelengths that the eye sees (nm): the cut-off tails hold 1e-4 of the white.
VISIBLE = (376.0, 744.0)

_FINE = 0.0004  # of ln λ, for the integrals of s̄
_BLOCK = 1 << 23  # numbers at a time: neither they nor their taps take more than 150 MB
# Along an axis; wider windows are applied to all bins at once, and then interpolated.
_MOST_TAPS = 10


def lobe_of(table: DiffractionTable) -> float:
    """Standard deviation of an order's lobe in (u, v), in the blue where it is narrowest.

    The speckle of a coherent sum is half as wide: its amplitudes beat with each other.
    """
    width = 0.44 / (2 * math.pi * math.sqrt(2.0) * table.sigma)
    return 0.5 * width if table.grid.coherent else width


def wavelength_weights(step: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (n,) in µm, even in ln λ, and what each adds to linear sRGB, (n, 3).

    Between them an integrand is taken to be linear in ln λ. The weights add up to white (1, 1, 1).
    """
    low, high = np.log(VISIBLE)
    count = math.ceil((high - low) / step) + 1
    nodes = low + step * np.arange(count)
    fine = np.arange(low, nodes[-1], _FINE)
    density = linear_srgb(response(np.exp(fine))) * np.exp(fine)[:, None]
    position = (fine - low) / step
    left = np.minimum(position.astype(int), count - 2)
    share = (position - left)[:, None]
    weights = np.zeros((count, 3))
    np.add.at(weights, left, (1.0 - share) * density)
    np.add.at(weights, left + 1, share * density)
    return np.exp(nodes) * 1e-3, weights / weights.sum(axis=0)


def order_0_colour(
    table: DiffractionTable, radii: NDArray[np.float64], z: NDArray[np.float64]
) -> NDArray[np.float32]:
    """RGB of order 0 alone, and a 0, at these radii (n,) and z (m,), shape (n, m, 4), 1/µm².

    It ends at the last radius.
    """
    lam, weights = wavelength_weights(0.5 * lobe_of(table) / 2.0)
    kappa = np.minimum(2 * np.pi * z[:, None] / lam, table.expansion.kappa_max)
    power = order_0_power(table, kappa)
    lobe = np.exp(-((table.sigma_0 * 2 * np.pi * radii[:, None] / lam) ** 2)) * table.order_0_ratio
    weights = np.pad(weights / lam[:, None] ** 2, [(0, 0), (0, 1)])
    result = np.einsum("nl,ml,lc->nmc", lobe, power, weights, optimize=True).astype(np.float32)
    result[-1] = 0.0
    return result


class OtherOrders:
    """All orders but order 0 as a series in z, wherever a polar grid has bins.

    The table's series in κ, of the *power* whatever it stores, is summed under the window.
    """

    def __init__(self, table: DiffractionTable) -> None:
        self._lobe = lobe_of(table)
        stored = table if table.grid.coherent else as_powers(table)
        self._table, self._shape, self._scale = table, table.grid.shape, stored.scale
        self._expansion = power_expansion(table) if table.grid.coherent else stored.expansion
        flat = np.ascontiguousarray(np.moveaxis(stored.coefficients, 0, 2), np.float32)
        self._bins = flat.reshape(self._shape[0] * self._shape[1], -1)
        self._smooth = tuple(taps > _MOST_TAPS for taps in table.grid.taps)
        for axis, exponent in enumerate(table.grid.exponents):
            if self._smooth[axis]:
                self._bins = _smoothed(self._bins, self._shape, 1 - axis, exponent)

    def blocks(
        self, grid: PolarGrid, band: range, azimuths: NDArray[np.int64], expansion: Expansion
    ) -> Iterator[tuple[int, NDArray[np.int64], NDArray[np.float32]]]:
        """Coefficients at some azimuths of all rings of a band, in blocks.

        Yields
        ------
        ring, azimuths, and coefficients (azimuths, intervals, 3, terms) in 1/µm².
        """
        # Neither the lobes nor the observer's curves may slip between two wavelengths
        lobe = self._lobe / min(grid.radius(band.stop - 1), RESOLVED_RADIUS)
        per_ring = math.ceil(grid.step / min(1.2 * lobe, 0.5 * grid.step))
        lam, weights = wavelength_weights(grid.step / per_ring)
        lam, weights = lam[::-1], weights[::-1]  # the frequency falls with λ
        parts = _parts(self._expansion, expansion, lam, weights)
        count = (len(band) - 1) * per_ring + len(lam)
        first = 2 * np.pi * grid.radius(band.start) / lam[0]
        frequency = first * np.exp(grid.step / per_ring * np.arange(count))
        # coefficients looked up at one point, or weights of its series
        width = max(self._bins.shape[1], self._expansion.intervals * self._expansion.terms)
        size = max(1, _BLOCK // (count * max(16, width)))
        for start in range(0, len(azimuths), size):
            block = azimuths[start : start + size]
            sums = self._sums(frequency, 2 * np.pi / grid.counts[band.start] * block)
            for n, ring in enumerate(band):
                result = np.zeros((len(block), expansion.intervals, 3, expansion.terms), np.float32)
                for part in parts:
                    lower, upper = part.wavelengths.start, part.wavelengths.stop
                    term = sums[:, part.source, n * per_ring + lower : n * per_ring + upper]
                    added = term.reshape(len(block), -1) @ part.matrix
                    result[:, part.targets] += added.reshape(len(block), -1, 3, expansion.terms)
                yield ring, block, result

    def _sums(
        self, frequency: NDArray[np.floating], azimuth: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Coefficients (azimuths, intervals, frequencies, terms) of the power's series."""
        table = self._table
        qx = np.outer(np.cos(azimuth), frequency).ravel()
        qy = np.outer(np.sin(azimuth), frequency).ravel()
        sums = self._taps(qx, qy) @ self._bins
        if table.grid.coherent:
            sums = self._coherent(sums, qx, qy)
        sums *= np.float32(1.0 / self._scale)
        shape = (len(azimuth), len(frequency), self._expansion.intervals, self._expansion.terms)
        return np.ascontiguousarray(sums.reshape(shape).transpose(0, 2, 1, 3))

    def _taps(self, qx: NDArray[np.float64], qy: NDArray[np.float64]) -> scipy.sparse.csr_array:
        """Weights from bins to points, a sparse (points, ny·nx) matrix."""
        grid, spacing = self._table.grid, self._table.spacing
        columns, weights_x = self._axis(qx / spacing[0], grid.last[0], grid.taps[0], 0)
        rows, weights_y = self._axis(qy / spacing[1], grid.last[1], grid.taps[1], 1)
        index = rows[:, :, None] * np.int32(self._shape[1]) + columns[:, None, :]
        weights = weights_y[:, :, None] * weights_x[:, None, :]
        each = index.shape[1] * index.shape[2]
        return scipy.sparse.csr_array(
            (weights.ravel(), index.ravel(), np.arange(0, index.size + 1, each, dtype=np.int32)),
            shape=(len(qx), self._shape[0] * self._shape[1]),
        )

    def _axis(
        self, position: NDArray[np.float64], last: int, taps: int, axis: int
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Array indices and weights of the taps along one axis, both (points, taps)."""
        if self._smooth[axis]:
            taps = 4
        lowest, distance = taps_at(position, last, taps)
        if self._smooth[axis]:
            weights = _cubic(distance[:, 1])
        else:
            weights = np.exp(-self._table.grid.exponents[axis] * distance**2)
        weights[np.abs(position) > last + taps] = 0.0
        index = np.asarray(lowest[:, None] + np.arange(taps), np.int32)
        return index, weights.astype(np.float32)

    def _coherent(
        self, amplitudes: NDArray[np.float32], qx: NDArray[np.float64], qy: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """The power's series of a sum of amplitudes, less the power of order 0 alone."""
        table = self._table
        old, new = table.expansion, self._expansion
        parts = amplitudes.reshape(len(amplitudes), old.intervals, 2, old.terms)
        x, y = qx / table.spacing[0], qy / table.spacing[1]
        lobe = np.exp(-table.grid.exponents[0] * x * x - table.grid.exponents[1] * y * y)

        def powers(kappa: float) -> NDArray[np.float32]:
            weights = (old.weights(kappa) / table.scale).astype(np.float32)
            amplitude = series_sum(parts[:, int(old.interval(kappa))], weights)
            # |o + c|² − |c|² = |o|² + 2 Re(o c*), c the part of order 0
            beats = 2.0 * lobe * (amplitude @ table.order_0_at(kappa))
            return np.asarray((amplitude**2).sum(axis=1) + beats, np.float32)

        series = fitted(new, powers) * np.float32(self._scale)
        return np.moveaxis(series, 0, 1).reshape(len(amplitudes), -1)


@dataclass(frozen=True)
class _Part:
    """Contribution of one interval of κ to the intervals of z, through a run of wavelengths.

    Attributes
    ----------
    source : the interval of κ.
    targets : consecutive intervals of z that the contribution is added to.
    wavelengths : the run of wavelengths.
    matrix : (wavelengths·terms, targets·3·terms).
    """

    source: int
    targets: slice
    wavelengths: slice
    matrix: NDArray[np.float32]


def _parts(
    source: Expansion,
    target: Expansion,
    wavelengths: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> list[_Part]:
    """Return how the series in κ at all wavelengths (n,) in µm make the series in z."""
    scaled = weights / wavelengths[:, None] ** 2
    nodes = np.array([target.nodes(n) for n in range(target.intervals)])
    fits = np.array([target.fit(n) for n in range(target.intervals)])
    kappa = np.minimum(2 * np.pi / wavelengths[:, None, None] * nodes, source.kappa_max)
    home = source.interval(kappa)
    parts = []
    for interval in np.unique(home):
        inside = home == interval
        run, targets = _run(inside.any(axis=(1, 2))), _run(inside.any(axis=(0, 2)))
        inside, at = inside[run, targets], kappa[run, targets]
        matrix = np.einsum(
            "lint,lc,inm->lticm",
            source.weights(np.where(inside, at, 0.0)) * inside[..., None],
            scaled[run],
            fits[targets],
            optimize=True,
        )
        flat = matrix.reshape((run.stop - run.start) * source.terms, -1)
        parts.append(_Part(int(interval), targets, run, np.ascontiguousarray(flat, np.float32)))
    return parts


def _run(used: NDArray[np.bool_]) -> slice:
    """Slice from the first to the last that is True."""
    indices = np.flatnonzero(used)
    return slice(int(indices[0]), int(indices[-1]) + 1)


def _smoothed(
    bins: NDArray[np.float32], shape: tuple[int, ...], axis: int, exponent: float
) -> NDArray[np.float32]:
    """The window applied to all bins along an axis on which it is many bins wide.

    Its sums are smooth there.
    """
    image = bins.reshape(*shape, -1)
    reach = math.ceil(4.2 / math.sqrt(exponent))
    kernel = np.exp(-exponent * np.arange(-reach, reach + 1) ** 2).astype(np.float32)
    image = scipy.ndimage.convolve1d(image, kernel, axis, mode="constant")
    return image.reshape(bins.shape)


def _cubic(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lagrange's weights (points, 4) for the taps at −1, 0, 1, 2; offset 0 … 1 from tap 0."""
    t = offset
    return np.stack(
        [
            -t * (t - 1) * (t - 2) / 6,
            (t + 1) * (t - 1) * (t - 2) / 2,
            -(t + 1) * t * (t - 2) / 2,
            (t + 1) * t * (t - 1) / 6,
        ],
        axis=1,
    )
