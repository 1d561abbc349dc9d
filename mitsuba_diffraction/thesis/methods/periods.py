"""Periods of a patch, estimated from the autocorrelation of the heights (NumPy only)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...heights import HeightField

#: Least confidence of a usable period: the ring-shaped autocorrelation of a random surface reaches
#: 0.1 by chance, snake scales across their fingers 0.5 and more.
LEAST_CONFIDENCE = 0.3

_SHORTEST, _LONGEST = 1e-2, 1e3  # periods that are accepted, µm


@dataclass(frozen=True)
class Period:
    """Estimate of a patch's period along one axis."""

    axis: str  # "x" or "y"
    length: float  # µm; NaN if the autocorrelation has no peak
    # 0 to 1, rise of the autocorrelation from its valley (or from 0, if that is higher) to its
    # peak at `length`; 1 for an exact grating
    confidence: float

    @property
    def reliable(self) -> bool:
        """Whether the confidence is at least `LEAST_CONFIDENCE`."""
        return self.confidence >= LEAST_CONFIDENCE

    def __str__(self) -> str:
        if not np.isfinite(self.length):
            return f"along {self.axis}: none"
        return f"along {self.axis}: {self.length:.4g} µm, confidence {self.confidence:.2f}"


def estimate_periods(field: HeightField) -> tuple[Period, Period]:
    """Estimate the periods along x and along y.

    The autocorrelation r of the heights, which tile the plane, is followed along each axis from lag
    0 down to the first valley and up to the first peak that rises by `LEAST_CONFIDENCE`, or else to
    the peak that rises most. A parabola through the peak and its neighbours gives the lag between
    pixels. Lags up to half of the patch are examined: the patch's length is a period of any tile.
    """
    centred = field.heights - field.heights.mean()
    power = np.abs(np.fft.fft2(centred)) ** 2
    # the mean over one axis of the 2D spectrum is the spectrum of lag 0 along that axis
    correlations = (np.fft.ifft(power.mean(axis=0)).real, np.fft.ifft(power.mean(axis=1)).real)
    periods = [
        _first_peak(axis, correlation, pixel)
        for axis, correlation, pixel in zip("xy", correlations, field.pixel_size, strict=True)
    ]
    return periods[0], periods[1]


def required_periods(field: HeightField, method: str, period: float | None) -> list[Period]:
    """Return the user's period, along the axis of greater confidence, or all reliable estimates.

    The first is the most reliable one; that along x if both are equal.
    """
    estimates = estimate_periods(field)
    best = sorted(estimates, key=lambda estimate: -estimate.confidence)
    if period is not None:
        return [Period(best[0].axis, check_period(period), 1.0)]
    if best[0].reliable:
        return [estimate for estimate in best if estimate.reliable]
    raise DiffractionError(
        f"method '{method}' needs a period, and {field.name} has no reliable one "
        f"({'; '.join(map(str, estimates))}; at least {LEAST_CONFIDENCE:g} is needed); give period "
        "in µm, or choose another method"
    )


def check_period(period: float) -> float:
    """Refuse a period that is out of range."""
    if not _SHORTEST <= period <= _LONGEST:
        raise DiffractionError(f"period={period} must be from {_SHORTEST:g} to {_LONGEST:g} µm")
    return float(period)


def _first_peak(axis: str, correlation: NDArray[np.float64], pixel: float) -> Period:
    """Return the period of the first high peak of an autocorrelation (n,), else of the highest."""
    if correlation[0] <= 0.0:  # a flat patch
        return Period(axis, np.nan, 0.0)
    r = correlation / correlation[0]
    half = r.size // 2
    valley = 1.0
    best = Period(axis, np.nan, 0.0)
    for lag in range(1, half + 1):  # inclusive: an odd number of pixels may hold two periods
        valley = min(valley, r[lag])
        before, after = r[lag - 1], r[(lag + 1) % r.size]
        if not (r[lag] > before and r[lag] >= after - 1e-12):
            continue
        rise = float(min(r[lag] - max(valley, 0.0), 1.0))
        if rise > best.confidence:
            bend = before - 2.0 * r[lag] + after
            shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
            best = Period(axis, float((lag + shift) * pixel), rise)
        if best.reliable:
            break
    return best
