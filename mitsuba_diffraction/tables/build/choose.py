"""Choice of terms and intervals for a tolerance, before anything large is computed."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import scipy
from numpy.typing import NDArray

from ...errors import DiffractionError, counted
from ...heights.field import HeightField
from ...settings import TableSettings
from ..expansion import Expansion, principal_functions
from ..table import build_error
from .error import FLOOR
from .spectrum import Spectrum

#: Terms of one interval when the user does not say: a packet of 8 is what processors gather at
#: best; shallow surfaces do with 4.
PACKET, SMALL_PACKET = 8, 4
#: Largest number of intervals that is tried.
MAX_INTERVALS = 1024

_SAMPLE = 160  # pixels a side of the cut-out that trials are made on
_TRIALS = 6  # intervals looked at in one trial, from the first to the last
_SINGLE_ROUNDING = 2.0**-24
#: Share of a series' budget that its interpolation between nodes may take, besides the functions.
_FINE, _LONGEST = 0.15, 200

_Maker = Callable[[int, int], Expansion]


def series_expansion(
    heights: HeightField,
    kappa_max: float,
    budget: float,
    terms: int | None,
    settings: TableSettings,
) -> tuple[Expansion, int | None]:
    """Return the initial Chebyshev series, and the number of `svd` functions, if any.

    Their error on a cut-out of the patch is at most `budget`; the exact measure on the whole patch
    has the last word (`tables.build`). Unless the user says how many functions, there are as many
    as make the smallest table, the fewer if that makes no difference.
    """
    kind = "amplitude" if settings.coherent else "power"

    def make(terms: int, intervals: int) -> Expansion:
        return Expansion("chebyshev", kind, terms, intervals, kappa_max, 0.5 * heights.range)

    if heights.range == 0.0:
        return make(terms or SMALL_PACKET, 1), None
    trial, svd = _Trial(heights, kappa_max), settings.basis != "chebyshev"

    def series(count: int, intervals: int) -> Expansion:
        length = max(count + 2, trial.length(make, intervals, budget)) if svd else count
        return make(length, intervals)

    def error(count: int, intervals: int) -> float:
        return trial.error(series(count, intervals), count if svd else None)

    count, intervals = SMALL_PACKET, 1
    if terms is not None or error(count, intervals) > budget:
        count = terms or PACKET
        intervals = _fewest_intervals(partial(series, count), partial(error, count), count, budget)
        if svd and terms is None and intervals == 1 and error(SMALL_PACKET, 2) <= budget:
            count, intervals = SMALL_PACKET, 2
    return series(count, intervals), count if svd else None


def _fewest_intervals(
    make: Callable[[int], Expansion], error: Callable[[int], float], terms: int, budget: float
) -> int:
    """About the smallest number of intervals whose error is at most `budget`."""
    # An interval's worth of phase that so many terms resolve, as a first guess
    first = make(1)
    guess = max(1, round(first.kappa_max * first.half_range / 8.0))
    if error(guess) <= budget:
        good = guess
        while good > 1 and error(good // 2) <= budget:
            good //= 2
        bad = good // 2
    else:
        bad, good = guess, 2 * guess
        while (smallest := error(good)) > budget:
            if good >= MAX_INTERVALS:
                raise too_many_intervals(make(good), terms, smallest)
            bad, good = good, 2 * good
    while good - bad > max(1, good // 16):
        middle = (good + bad) // 2
        good, bad = (middle, bad) if error(middle) <= budget else (good, middle)
    return good


def too_many_intervals(expansion: Expansion, terms: int, error: float) -> DiffractionError:
    """Error about a series that needs more intervals than make sense."""
    return build_error(
        f"{counted(expansion.intervals, 'interval')} of κ with {counted(terms, 'term')} each "
        f"still leave an error of {error:.2g} for heights of {2 * expansion.half_range:.3g} µm; "
        "give more terms or a larger tolerance"
    )


def taylor_expansion(
    heights: HeightField, kappa_max: float, budget: float, terms: int | None
) -> Expansion:
    """The Taylor series with as many terms as bring a bound below the budget.

    |exp(iφ) − Σ_{n≤N} (iφ)ⁿ/n!| ≤ |φ|^(N+1)/(N+1)!; by Parseval the amplitudes are off by its
    root mean square δ over the patch, and the power, by Cauchy and Schwarz, by at most 2δ.
    """
    count = terms or 1
    while terms is None and count < 400:
        log_x, log_moment = _log_moments(heights, kappa_max, count + 1)
        log_bound = (count + 1) * log_x - scipy.special.gammaln(count + 2) + 0.5 * log_moment[-1]
        if _exp(math.log(2.0) + log_bound) <= budget:
            break
        count += 1
    return Expansion("taylor", "amplitude", count, 1, kappa_max, 0.5 * heights.range)


def taylor_rounding(heights: HeightField, kappa_max: float, terms: int) -> float:
    """Predicted relative error that single precision leaves: the terms' own rounding adds up."""
    if 0.5 * heights.range == 0.0:
        return 0.0
    log_x, log_moment = _log_moments(heights, kappa_max, terms)
    n = np.arange(1, terms + 1)
    log_squares = 2.0 * (n * log_x - scipy.special.gammaln(n + 1)) + log_moment
    log_sum = float(np.logaddexp.reduce(log_squares))
    return _exp(math.log(2.0 * _SINGLE_ROUNDING) + 0.5 * log_sum)


def _log_moments(
    heights: HeightField, kappa_max: float, last: int
) -> tuple[float, NDArray[np.float64]]:
    """log x, and log mean (2h/H)^2n for n = 1 … last, of centred heights."""
    sample = heights.heights.ravel()
    sample = sample[:: max(1, sample.size // 50_000)]
    half = 0.5 * heights.range
    if half == 0.0:
        return -math.inf, np.zeros(last)
    low = float(heights.heights.min())
    unit = np.abs((sample - low) / half - 1.0)
    log_square = 2.0 * np.log(np.maximum(unit, 1e-12))
    moments = [
        np.logaddexp.reduce(n * log_square) - math.log(unit.size) for n in range(1, last + 1)
    ]
    return math.log(kappa_max * half), np.array(moments)


def _exp(x: float) -> float:
    return math.exp(x) if x < 700.0 else math.inf


class _Trial:
    """Series errors on a cut-out of the patch, without window and taps."""

    def __init__(self, heights: HeightField, kappa_max: float) -> None:
        ny, nx = heights.shape
        top, left = max(0, (ny - _SAMPLE) // 2), max(0, (nx - _SAMPLE) // 2)
        cut = heights.heights[top : top + _SAMPLE, left : left + _SAMPLE]
        # The range must be the whole patch's: the extremes may lie outside the cut-out
        cut = np.concatenate(
            [cut, np.resize([heights.heights.min(), heights.heights.max()], (1, cut.shape[1]))]
        )
        field = HeightField(cut, heights.pixel_size, name=heights.name)
        last = tuple(
            min(n // 2, math.ceil(kappa_max * length / (2 * np.pi)))
            for n, length in zip(field.shape[::-1], field.extent, strict=True)
        )
        # In single precision its rounding would look like a series that is too short
        self._spectrum = Spectrum(field, (last[0], last[1]), double=True)
        self._centre = (last[1], last[0])
        self._lengths: dict[int, int] = {}
        self._known: dict[tuple[float, str], NDArray[np.floating]] = {}

    def length(self, make: _Maker, intervals: int, budget: float) -> int:
        """Terms of a Chebyshev series that is so good that the functions' number is what counts."""
        if intervals not in self._lengths:
            length = SMALL_PACKET + 2
            while self.error(make(length, intervals)) > _FINE * budget and length < _LONGEST:
                length = math.ceil(1.2 * length)
            self._lengths[intervals] = length
        return self._lengths[intervals]

    def error(self, expansion: Expansion, functions: int | None = None) -> float:
        """Worst relative error near and away from order 0, over a few intervals.

        functions : of basis "svd" that the Chebyshev series is made into, if it is.
        """
        count = min(expansion.intervals, _TRIALS)
        errors, exact = [], []
        for interval in np.unique(np.linspace(0, expansion.intervals - 1, count).round()).astype(
            int
        ):
            values = np.stack([self._values(k, expansion) for k in expansion.nodes(interval)])
            specular = expansion.order_0_offset(interval)
            values[:, *self._centre, 0] -= specular
            fit, series = expansion.fit(interval), np.eye(len(values))
            order_0 = values[:, *self._centre].T @ fit
            values[:, *self._centre] = 0.0
            flat = values.reshape(len(values), -1)
            if functions is not None:
                near = self._near(values.shape[-1])
                fit, series = principal_functions(flat, expansion, interval, functions, near)
            bins = (flat.T @ fit).reshape(*values.shape[1:], -1)
            for kappa in expansion.extrema(interval):
                weights = expansion.series_weights(kappa)
                table, truth = bins @ (weights @ series), self._values(kappa, expansion)
                table[self._centre] = order_0 @ weights
                table[*self._centre, 0] += specular
                table, truth = expansion.power_of(table), expansion.power_of(truth)
                errors.append(self._parts(np.abs(table - truth)))
                exact.append(self._parts(truth))
        scale = np.maximum(exact, FLOOR * np.max(exact, axis=0))
        return float(np.max(np.array(errors) / np.maximum(scale, 1e-30)))

    def _near(self, parts: int) -> NDArray[np.int64]:
        """Indices (…, parts) of the bins around order 0."""
        row, column = self._centre
        rows, columns = np.mgrid[row - 1 : row + 2, column - 1 : column + 2].reshape(2, -1)
        bins = (rows * (2 * column + 1) + columns)[np.arange(9) != 4]
        return np.asarray((bins[:, None] * parts + np.arange(parts)).ravel())

    def _values(self, kappa: float, expansion: Expansion) -> NDArray[np.floating]:
        """Powers (ny, nx, 1), or the parts of amplitudes (ny, nx, 2); trials share nodes."""
        key = float(kappa), expansion.kind
        if key not in self._known:
            amplitude = self._spectrum.of_phase(kappa, minus_one=True)
            amplitude[self._centre] += 1.0
            power = expansion.kind == "power"
            parts = (np.abs(amplitude) ** 2,) if power else (amplitude.real, amplitude.imag)
            self._known[key] = np.stack(parts, axis=-1)
        return self._known[key]

    def _parts(self, bins: NDArray[np.floating]) -> tuple[float, float]:
        row, column = self._centre
        near = float(bins[row - 1 : row + 2, column - 1 : column + 2].sum())
        return near, float(bins.sum()) - near
