"""The period of a patch along an axis, from the autocorrelation of its heights (NumPy only)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...heights.field import HeightField

#: Below this confidence a patch counts as having no period: the ring-shaped autocorrelation of a
#: random surface reaches 0.1 by chance, snake scales across their fingers 0.5 and more.
LEAST_CONFIDENCE = 0.3

_SHORTEST, _LONGEST = 1e-2, 1e3  # µm


@dataclass(frozen=True)
class Period:
    """An estimate."""

    axis: str  # "x" or "y"
    length: float  # µm; NaN where the autocorrelation has no peak at all
    # 0 to 1, how far the autocorrelation rises from its valley (or from 0, if that is higher) to
    # its peak at `length`; 1 for an exact grating
    confidence: float

    @property
    def found(self) -> bool:
        """Whether it is worth using."""
        return self.confidence >= LEAST_CONFIDENCE

    def __str__(self) -> str:
        if not np.isfinite(self.length):
            return f"along {self.axis}: none"
        return f"along {self.axis}: {self.length:.4g} µm, confidence {self.confidence:.2f}"


def estimate_periods(field: HeightField) -> tuple[Period, Period]:
    """Periods along x and along y.

    The autocorrelation r of the heights, which tile the plane, is followed along each axis from lag
    0 down to its first valley and up to the first peak that rises by `LEAST_CONFIDENCE`, or else to
    the peak that rises most; a parabola through the peak and its neighbours gives the lag between
    pixels. Lags up to half of the patch are looked at: its own length is a period of any tile.
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


def main_period(field: HeightField) -> Period:
    """The estimate with the greater confidence; x if they are alike."""
    along_x, along_y = estimate_periods(field)
    return along_y if along_y.confidence > along_x.confidence else along_x


def required_period(field: HeightField, method: str, period: float | None) -> Period:
    """The period that a method needs: the given one (along the main axis), or the estimate.

    Raises
    ------
    DiffractionError
        If `period` is out of range, or the patch has none.
    """
    estimate = main_period(field)
    if period is not None:
        return Period(estimate.axis, check_period(period), 1.0)
    if estimate.found:
        return estimate
    both = "; ".join(str(p) for p in estimate_periods(field))
    raise DiffractionError(
        f"method '{method}' needs a period, and {field.name} has none that shows ({both}; "
        f"at least {LEAST_CONFIDENCE:g} is needed); give period in µm, or choose another method"
    )


def check_period(period: float) -> float:
    """Refuse a period that is none."""
    if not _SHORTEST <= period <= _LONGEST:
        raise DiffractionError(f"period={period} must be from {_SHORTEST:g} to {_LONGEST:g} µm")
    return float(period)


def _first_peak(axis: str, correlation: NDArray[np.float64], pixel: float) -> Period:
    if correlation[0] <= 0.0:  # a flat patch
        return Period(axis, np.nan, 0.0)
    r = correlation / correlation[0]
    half = r.size // 2
    valley = 1.0
    best = Period(axis, np.nan, 0.0)
    for lag in range(1, half + 1):  # two periods of an odd number of pixels peak at half a lag more
        valley = min(valley, r[lag])
        before, after = r[lag - 1], r[(lag + 1) % r.size]
        if not (r[lag] > before and r[lag] >= after - 1e-12):
            continue
        rise = float(min(r[lag] - max(valley, 0.0), 1.0))
        if rise > best.confidence:
            bend = before - 2.0 * r[lag] + after
            shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
            best = Period(axis, float((lag + shift) * pixel), rise)
        if best.found:
            break
    return best
