"""Ridge of maxima of a response, and the period for which the grating equation fits it.

The response is measured by a virtual goniometer: a monochromatic beam, and a detector that swings
through the plane of incidence. Viewing angles have the sign of `spectrum`'s detectors: the mirror
direction is +θi, and orders m > 0 are on the light's side of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...analysis.maps.hemisphere import polar
from ...analysis.maps.result import LightDirection
from ...arrays import Real
from ...errors import DiffractionError
from ...optics.geometry import wavenumber
from ...progress import Progress

#: brdf(wi, wo, wavelength) in 1/sr for (n, 3), (n, 3) and (n,) nm.
Brdf = Callable[[Real, Real, Real], Real]

#: Largest number of values in a response: 160 MB.
MOST_POINTS = 20_000_000

#: Least number of maxima that determine a period.
FEWEST = 5
#: Least share of the light on an order's side that a grating sends into the order, and least ratio
#: of the order's brightness to that of the surroundings, half an octave on either side.
LEAST_SHARE, LEAST_RATIO = 0.05, 4.0
# Relative half widths of an irregular grating's order and of the surroundings.
_SPREAD, _AROUND = 0.07, 0.5
# Largest factor between a period of the heights and the one of the light.
_AGREES = 1.15
# Half width of order 0's lobe in units of 1/σ: beyond it exp(−25), 1e-11, of its power is left.
_ORDER_0 = 5.0
# Light this much weaker than the brightest order is the tail of the window, not a maximum.
_MIN_RELATIVE = 1e-12
# Number of periods that are tried, evenly spaced in frequency.
_LINES = 4000


@dataclass(frozen=True)
class Beam(LightDirection):
    """Direction of the light, which defines the plane of incidence, and the medium of its waves.

    index : n of the medium above the patch. Wavelengths are in vacuum; waves have λ/n.
    """

    theta: float = 75.0
    index: float = 1.0

    @property
    def sine(self) -> float:
        """Sine of the angle of incidence, sinθi."""
        return math.sin(math.radians(self.theta))

    def views(self, angles: Real) -> Real:
        """Return ωo (n, 3) of viewing angles in degrees, positive away from the light."""
        return polar(-np.radians(angles), math.radians(self.phi))

    def waves(self, wavelength: Real) -> Real:
        """Return the wavelengths in the medium, µm, of wavelengths in vacuum, nm."""
        return wavelength * 1e-3 / self.index

    def grating_angles(self, wavelength: Real, period: float, order: int) -> Real:
        """Return the viewing angles with sinθo = sinθi − mλ/(n d), degrees; NaN without an order.

        Parameters
        ----------
        wavelength : λ, nm.
        period : d, µm.
        order : m.
        """
        sine = self.sine - order * self.waves(wavelength) / period
        return np.degrees(np.arcsin(np.where(np.abs(sine) <= 1.0, sine, np.nan)))


@dataclass(frozen=True, eq=False)
class Response:
    """Angle-resolved scatter of a patch, by wavelength and viewing angle."""

    beam: Beam
    wavelengths: Real  # (L,), nm
    angles: Real  # (A,), degrees, ascending
    # (L, A), f·cosθo in 1/sr: share of the beam's power per solid angle at a small detector
    values: Real
    # σ of the window, µm, times the medium's index: 1/(σk) is the width of order 0, k in vacuum
    sigma: float
    label: str  # name of the method


def measure(
    brdf: Brdf,
    beam: Beam,
    wavelengths: Real,
    angles: Real,
    *,
    sigma: float,
    label: str,
    progress: Progress | None = None,
) -> Response:
    """Evaluate a BRDF for every wavelength (nm) at every viewing angle (degrees).

    Raises a DiffractionError if there are too few or too many wavelengths or angles, or an angle is
    beyond ±90°.
    """
    check_axes(wavelengths, angles)
    views = beam.views(angles)
    lights = np.broadcast_to(beam.direction, views.shape)
    values = np.empty((wavelengths.size, angles.size))
    for n, wavelength in enumerate(wavelengths):
        f = brdf(lights, views, np.full(angles.size, wavelength))
        values[n] = f * views[:, 2]
        if progress is not None:
            progress(n + 1, wavelengths.size, f"measuring {label}")
    return Response(beam, wavelengths, angles, values, sigma, label)


def check_axes(wavelengths: Real, angles: Real) -> None:
    """Refuse axes with too few or too many values, or with values out of range."""
    if wavelengths.size < 2 or angles.size < 8:
        raise DiffractionError(
            f"{wavelengths.size} wavelengths and {angles.size} angles are too few; widen the ranges"
            " or make the steps smaller"
        )
    if not (np.all(wavelengths > 0.0) and np.all(np.abs(angles) < 90.0)):
        raise DiffractionError(
            "wavelengths must be above 0 nm, and viewing angles above -90 and below 90 degrees"
        )
    if wavelengths.size * angles.size > MOST_POINTS:
        raise DiffractionError(
            f"{wavelengths.size} wavelengths at {angles.size} angles are more than {MOST_POINTS} "
            "points; make the steps larger"
        )


@dataclass(frozen=True, eq=False)
class Ridge:
    """Viewing angle of the maximum at each wavelength."""

    response: Response
    order: int
    angles: Real  # (L,), degrees; NaN without a maximum
    heights: Real  # (L,), f·cosθo at the maximum, 1/sr

    @property
    def has_maximum(self) -> NDArray[np.bool_]:
        """Whether a maximum exists at each wavelength, (L,)."""
        return np.isfinite(self.angles)

    @property
    def frequency(self) -> Real:
        """Coordinate |u| = |sinθi − sinθo| of the maxima, (L,)."""
        return np.abs(self.response.beam.sine - np.sin(np.radians(self.angles)))

    def grating_angles(self, period: float) -> Real:
        """Return the angles of the grating equation for a period in µm, (L,), degrees."""
        return self.response.beam.grating_angles(self.response.wavelengths, period, self.order)


@dataclass(frozen=True)
class Fit:
    """Period of the grating equation that fits a ridge, and how well it fits."""

    period: float  # µm
    error: float  # standard error, µm: scatter about the fit, and biases of the maxima
    residual: float  # RMS difference of ridge and grating equation, degrees
    largest: float  # largest difference, degrees
    points: int  # number of maxima
    wavelengths: int  # number of wavelengths


def ridge_of(
    response: Response, order: int = 1, *, period: float | None = None, within: float = 1.1
) -> Ridge:
    """Find the brightest viewing angle at each wavelength on the side of an order.

    With a `period` in µm, only angles count that belong to periods up to `within` times larger or
    smaller.

    The lobe of order 0, |u| < 5/(σk), and the other side of it are excluded. As in the thesis, the
    brightest remaining sample is the maximum; a parabola through the logarithms of three neighbours
    refines it, which is exact for a Gaussian lobe. Maxima at the end of the range do not count.

    Raises a DiffractionError if `order` is 0.
    """
    u = _frequencies(response, order)
    lobe = _ORDER_0 / (response.sigma * wavenumber(response.wavelengths))[:, None]
    allowed = u[None, :] > lobe
    if period is not None:
        expected = abs(order) * response.beam.waves(response.wavelengths)[:, None] / period
        allowed &= u[None, :] > np.minimum(expected / within, expected - lobe)
        allowed &= u[None, :] < np.maximum(expected * within, expected + lobe)
    values = np.where(allowed, response.values, -1.0)
    peak = values.argmax(axis=1)
    rows = np.arange(len(peak))
    inner = np.clip(peak, 1, response.angles.size - 2)
    around = np.stack([values[rows, inner + shift] for shift in (-1, 0, 1)])
    good = (peak == inner) & np.all(around >= 0.0, axis=0)
    good &= around[1] > _MIN_RELATIVE * response.values.max(initial=0.0)
    before, middle, after = np.log(np.where(good & np.all(around > 0.0, axis=0), around, 1.0))
    bend = before - 2.0 * middle + after
    curved = bend < 0.0  # methods that sample few wavelengths may be 0 at the neighbours
    shift = np.where(curved, 0.5 * (before - after) / np.where(curved, bend, -1.0), 0.0)
    step = np.where(
        shift > 0.0,
        response.angles[inner + 1] - response.angles[inner],
        response.angles[inner] - response.angles[inner - 1],
    )
    angles = np.where(good, response.angles[inner] + shift * step, np.nan)
    heights = np.where(good, around[1] * np.exp(-0.25 * (before - after) * shift), np.nan)
    return Ridge(response, order, angles, heights)


def find_period(response: Response, expected: Sequence[float], order: int = 1) -> float | None:
    """Return the period of the strongest ridge that obeys the grating equation, µm, or None.

    An order of a grating has one u/λ at all wavelengths in the medium. So the response is averaged
    over the wavelengths at each u/λ. The ridge is the u/λ with the largest share of the light on
    the order's side, among those whose lobe is brighter than its surroundings.

    Raises a DiffractionError if `order` is 0.

    expected : periods in µm along the plane of incidence that the heights hold, as
        `heights.spectra.dominant_periods` finds them. The light alone does not tell: the few orders
        of a small rough patch obey the equation, too, and one of them is the brightest.
    """
    u = _frequencies(response, order)
    wavelengths = response.beam.waves(response.wavelengths)
    sigma = response.sigma / response.beam.index
    # lower orders of the same gratings send more light
    lower = abs(order) - 0.5 if abs(order) > 1 else 0.0
    first = max(_ORDER_0 / (2.0 * np.pi * sigma), lower / max(expected, default=np.inf))
    last = u.max() / wavelengths.min()
    if not last > first:
        return None
    lines = np.linspace(first, last, _LINES)  # u/λ, 1/µm
    upward = np.argsort(u)
    # as a function of u/λ, light decreases with λ² (Stam 1999, eq. 7)
    light = np.array([
        np.interp(lines * wavelength, u[upward], row[upward], left=np.nan, right=np.nan)
        * wavelength**2
        for wavelength, row in zip(wavelengths, response.values, strict=True)
    ])  # fmt: skip
    seen = np.isfinite(light).sum(axis=0) >= min(FEWEST, wavelengths.size)
    if seen.sum() < FEWEST:
        return None
    lines, light = lines[seen], np.nanmean(light[:, seen], axis=0)
    share, ratio = _contrast(lines, light, sigma)
    periods = abs(order) / lines
    known = np.reshape(expected, (-1, 1))
    agrees = (periods < _AGREES * known) & (periods * _AGREES > known)
    strong = agrees.any(axis=0) & (share >= LEAST_SHARE) & (ratio >= LEAST_RATIO)
    if not strong.any():
        return None
    return float(periods[np.where(strong, share, 0.0).argmax()])


def _contrast(lines: Real, light: Real, sigma: float) -> tuple[Real, Real]:
    """Return the contrast of a lobe around each of `lines` (n,).

    Returns
    -------
    The lobe's share of the light, and the ratio of its brightness to the surroundings', both (n,).
    """
    step = lines[1] - lines[0]
    edges = np.append(lines, lines[-1] + step) - 0.5 * step
    total = np.append(0.0, np.cumsum(light)) * step

    def within(low: Real, high: Real) -> tuple[Real, Real]:
        """Integrate the light from `low` to `high`; also return the clipped width."""
        low, high = np.clip(low, edges[0], edges[-1]), np.clip(high, edges[0], edges[-1])
        return np.interp(high, edges, total) - np.interp(low, edges, total), high - low

    # three standard deviations of the window's lobe, or the spread of an irregular grating
    half = np.maximum(_SPREAD * lines, 3.0 / (2.0**1.5 * np.pi * sigma))
    lobe, width = within(lines - half, lines + half)
    far = np.maximum(_AROUND * lines, 1.5 * half)
    around, length = within(lines - far, lines + far)
    beside = np.maximum((around - lobe) / np.maximum(length - width, step), 1e-300)
    return lobe / max(total[-1], 1e-300), lobe / width / beside


def check_order(order: int) -> None:
    """Refuse order 0, which no period follows from."""
    if order == 0:
        raise DiffractionError(
            "order=0 is the mirror direction at every wavelength; give 1, -1, 2, ..."
        )


def _frequencies(response: Response, order: int) -> Real:
    """Return u = sinθi − sinθo (A,), positive on the side of an order."""
    check_order(order)
    u = response.beam.sine - np.sin(np.radians(response.angles))
    return np.asarray(np.sign(order) * u)


def fit_period(ridge: Ridge) -> Fit:
    """Fit the period d whose |mλ/(n d)| is closest to the ridge's |u|.

    The fit is by least squares in u, soft L1 beyond the width of a lobe, since the ridge of an
    irregular patch may jump between speckles at some wavelengths.

    Raises a DiffractionError if there are fewer than `FEWEST` maxima.
    """
    fitted = ridge.has_maximum
    response = ridge.response
    if fitted.sum() < FEWEST:
        raise DiffractionError(
            f"{response.label}: {fitted.sum()} of {fitted.size} wavelengths have a maximum on the "
            f"side of order {ridge.order}, too few to fit a period to (at least {FEWEST}); widen "
            "the ranges of angles and wavelengths, or choose another order"
        )
    abscissa = abs(ridge.order) * response.beam.waves(response.wavelengths[fitted])
    u = ridge.frequency[fitted]
    lobe = float(np.median(1.0 / (response.sigma * wavenumber(response.wavelengths))))
    start = float(np.median(u / abscissa))
    result = least_squares(
        lambda s: u - abscissa * s[0], [start], loss="soft_l1", f_scale=lobe,
        x_scale=start, xtol=1e-12, ftol=1e-12, gtol=1e-12,
    )  # fmt: skip
    period = float(1.0 / result.x[0])
    difference = ridge.angles - ridge.grating_angles(period)
    difference = difference[np.isfinite(difference)]
    return Fit(
        period=period,
        error=_error(ridge, abscissa, u, period),
        residual=float(np.sqrt(np.mean(difference**2))) if difference.size else np.nan,
        largest=float(np.abs(difference).max()) if difference.size else np.nan,
        points=int(fitted.sum()),
        wavelengths=int(fitted.size),
    )


def _error(ridge: Ridge, abscissa: Real, u: Real, period: float) -> float:
    """Return the error of a period fitted to u over mλ, µm: scatter, and two biases, which add up.

    Scatter: the standard error of the slope u over mλ (least squares). Slope: where the brightness
    changes with u, the maximum of a Gaussian lobe of variance s² is shifted by s² d(ln f)/du; the
    gradient is that along the ridge. Offset: light of other orders, which a window of few periods
    leaves beneath the lobe, and a tilt shift u alike at all wavelengths, so that the line through
    the maxima misses 0; the fit takes that for a slope.
    """
    fitted, response = ridge.has_maximum, ridge.response
    rest = u - abscissa / period
    scatter = math.sqrt(float(rest @ rest) / (u.size - 1) / float(abscissa @ abscissa)) * period
    # σ_u² of exp(−σ²k²Δu²)
    variance = 0.5 / (response.sigma * wavenumber(response.wavelengths[fitted])) ** 2
    gradient = float(np.polyfit(u, np.log(ridge.heights[fitted]), 1)[0])
    slope = abs(gradient * float(np.mean(variance / u)))
    offset = abs(float(np.polyfit(abscissa, u, 1)[1])) * period
    offset *= float(abscissa.sum() / (abscissa @ abscissa))
    return period * math.hypot(scatter, slope + offset)
