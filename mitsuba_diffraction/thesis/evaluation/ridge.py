"""The ridge of maxima under a beam, and the period for which the grating equation runs along it.

A virtual bench: a monochromatic beam, a detector that swings through its plane of incidence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...analysis.maps.result import Light
from ...errors import DiffractionError
from ...optics.geometry import wavenumber
from ...progress import Progress

Array = NDArray[np.float64]
#: brdf(wi, wo, wavelength) in 1/sr for (n, 3), (n, 3) and (n,) nm.
Brdf = Callable[[Array, Array, Array], Array]

MOST_POINTS = 20_000_000

#: Fewer maxima than this determine no period.
FEWEST = 5
#: Share of the light on an order's side that a grating sends into the order, at least; and how much
#: brighter its lobe is than what is within an octave.
LEAST_SHARE, LEAST_RATIO = 0.05, 4.0
# Relative half widths of an irregular grating's order and of what it is compared with.
_SPREAD, _AROUND = 0.07, 0.5
# A period found in the heights and one found in the light agree to this factor.
_AGREES = 1.15
# In units of 1/σ: beyond it exp(−25), 1e-11, is left of order 0's power.
_ORDER_0 = 5.0
# Light this much weaker than the brightest order is the window's own tail, not a maximum.
_FAINT = 1e-12
# Periods that are tried, evenly spaced in frequency.
_LINES = 4000


@dataclass(frozen=True)
class Beam(Light):
    """Direction of the light, and with it the plane of incidence; parameters as of `Light`."""

    theta: float = 75.0

    @property
    def sine(self) -> float:
        """sinθi."""
        return math.sin(math.radians(self.theta))

    def views(self, angles: Array) -> Array:
        """ωo, (n, 3), for viewing angles in degrees, positive on the light's side of the normal."""
        theta, phi = np.radians(angles), math.radians(self.phi)
        sine = np.sin(theta)
        return np.stack([sine * math.cos(phi), sine * math.sin(phi), np.cos(theta)], axis=-1)

    def grating_angles(self, wavelength: Array, period: float, order: int) -> Array:
        """Viewing angles where sinθo = mλ/d − sinθi, degrees; NaN where there is none.

        wavelength : nm. period : µm.
        """
        sine = order * wavelength * 1e-3 / period - self.sine
        return np.degrees(np.arcsin(np.where(np.abs(sine) <= 1.0, sine, np.nan)))


@dataclass(frozen=True, eq=False)
class Response:
    """What leaves the patch, by wavelength and viewing angle."""

    beam: Beam  # the light
    wavelengths: Array  # (L,), nm
    angles: Array  # (A,), degrees, rising
    # (L, A), angle-resolved scatter f·cosθo in 1/sr: the share of the beam's power that a small
    # detector gets, per solid angle
    values: Array
    sigma: float  # µm, of the window; sets how far order 0 reaches
    label: str  # which method


def measure(
    brdf: Brdf,
    beam: Beam,
    wavelengths: Array,
    angles: Array,
    *,
    sigma: float,
    label: str,
    progress: Progress | None = None,
) -> Response:
    """Evaluate a BRDF for every wavelength (nm) at every viewing angle (degrees).

    Raises
    ------
    DiffractionError
        If there are too few or too many of either, or an angle is beyond ±90°.
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


def check_axes(wavelengths: Array, angles: Array) -> None:
    """Refuse axes that make no plot."""
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

    response: Response  # where it was found
    order: int  # whose it is
    angles: Array  # (L,), degrees; NaN where there is none
    heights: Array  # (L,), f·cosθo there, 1/sr

    @property
    def found(self) -> NDArray[np.bool_]:
        """Wavelengths (L,) that have a maximum."""
        return np.isfinite(self.angles)

    @property
    def frequency(self) -> Array:
        """|u| = |sinθi + sinθo| at the maxima, (L,)."""
        return np.abs(self.response.beam.sine + np.sin(np.radians(self.angles)))


@dataclass(frozen=True)
class Fit:
    """The grating equation, fitted to a ridge."""

    period: float  # µm
    residual: float  # degrees, root mean square of ridge less grating equation
    largest: float  # degrees, the largest difference
    # points, wavelengths: maxima that were found, of how many wavelengths
    points: int
    wavelengths: int


def ridge_of(
    response: Response, order: int = 1, *, period: float | None = None, within: float = 1.1
) -> Ridge:
    """At each wavelength, where the patch sends most light on the side of that order.

    With a `period` in µm, only where the grating equation has a period up to `within` times larger
    or smaller.

    Order 0 is left out up to where its lobe ends, |u| = 5/(σk), and so is the other side of it: the
    brightest point of what remains is taken, as in the thesis, between samples by a
    parabola through the logarithms of three neighbours, which is exact for a Gaussian lobe. A
    maximum at the end of the range is none.

    Raises
    ------
    DiffractionError
        If `order` is 0.
    """
    u = _frequencies(response, order)
    lobe = _ORDER_0 / (response.sigma * wavenumber(response.wavelengths))[:, None]
    allowed = u[None, :] > lobe
    if period is not None:
        expected = abs(order) * response.wavelengths[:, None] * 1e-3 / period
        allowed &= u[None, :] > np.minimum(expected / within, expected - lobe)
        allowed &= u[None, :] < np.maximum(expected * within, expected + lobe)
    values = np.where(allowed, response.values, -1.0)
    peak = values.argmax(axis=1)
    rows = np.arange(len(peak))
    inner = np.clip(peak, 1, response.angles.size - 2)
    around = np.stack([values[rows, inner + shift] for shift in (-1, 0, 1)])
    good = (peak == inner) & np.all(around >= 0.0, axis=0)
    good &= around[1] > _FAINT * response.values.max(initial=0.0)
    before, middle, after = np.log(np.where(good & np.all(around > 0.0, axis=0), around, 1.0))
    bend = before - 2.0 * middle + after
    curved = bend < 0.0  # not so where a method knows nothing of the neighbours
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
    """Period of the strongest ridge that obeys the grating equation, µm; None if there is none.

    Light that a grating sends lies at one u/λ for all wavelengths. So the response is averaged over
    the wavelengths at each u/λ, and the ridge is that with the largest share of the light on the
    order's side whose lobe also stands out of its surroundings.

    Parameters
    ----------
    expected : periods in µm along the plane of incidence that the heights hold, as
        `heights.spectra.dominant_periods` finds them. The light alone does not tell: the few orders
        of a small rough patch obey the equation, too, and one of them is the brightest.

    Raises
    ------
    DiffractionError
        If `order` is 0.
    """
    u = _frequencies(response, order)
    wavelengths = response.wavelengths * 1e-3
    first = _ORDER_0 / (2.0 * np.pi * response.sigma)
    last = u.max() / wavelengths.min()
    if not last > first:
        return None
    lines = np.linspace(first, last, _LINES)  # u/λ, 1/µm
    upward = np.argsort(u)
    # in the grating equation's own units light falls with λ² (Stam 1999, eq. 7)
    light = np.array([
        np.interp(lines * wavelength, u[upward], row[upward], left=np.nan, right=np.nan)
        * wavelength**2
        for wavelength, row in zip(wavelengths, response.values, strict=True)
    ])  # fmt: skip
    seen = np.isfinite(light).sum(axis=0) >= min(FEWEST, wavelengths.size)
    if seen.sum() < FEWEST:
        return None
    lines, light = lines[seen], np.nanmean(light[:, seen], axis=0)
    share, ratio = _standing_out(lines, light, response.sigma)
    periods = abs(order) / lines
    agrees = np.zeros(periods.shape, bool)
    for period in expected:
        agrees |= (periods < _AGREES * period) & (periods * _AGREES > period)
    strong = agrees & (share >= LEAST_SHARE) & (ratio >= LEAST_RATIO)
    if not strong.any():
        return None
    return float(periods[np.where(strong, share, 0.0).argmax()])


def _standing_out(lines: Array, light: Array, sigma: float) -> tuple[Array, Array]:
    """Share of the light in a lobe around each of `lines` (n,), and its brightness over that of the
    surroundings, both (n,).
    """
    step = lines[1] - lines[0]
    edges = np.append(lines, lines[-1] + step) - 0.5 * step
    total = np.append(0.0, np.cumsum(light)) * step

    def within(low: Array, high: Array) -> tuple[Array, Array]:
        low, high = np.clip(low, edges[0], edges[-1]), np.clip(high, edges[0], edges[-1])
        return np.interp(high, edges, total) - np.interp(low, edges, total), high - low

    # three standard deviations of the window's own lobe, or the spread of an irregular grating
    half = np.maximum(_SPREAD * lines, 3.0 / (2.0**1.5 * np.pi * sigma))
    lobe, width = within(lines - half, lines + half)
    far = np.maximum(_AROUND * lines, 1.5 * half)
    around, length = within(lines - far, lines + far)
    beside = np.maximum((around - lobe) / np.maximum(length - width, step), 1e-300)
    return lobe / max(total[-1], 1e-300), lobe / width / beside


def _frequencies(response: Response, order: int) -> Array:
    """u = sinθi + sinθo (A,), positive on the side of an order."""
    if order == 0:
        raise DiffractionError("order=0 is the mirror's, at every wavelength; give 1, -1, 2, ...")
    u = response.beam.sine + np.sin(np.radians(response.angles))
    return np.asarray(np.sign(order) * u)


def fit_period(ridge: Ridge) -> Fit:
    """The period d whose |mλ/d| is closest to the ridge's |u|.

    Least squares in u, robust (soft L1 beyond the width of a lobe), since the ridge of an irregular
    patch may jump between speckles at some wavelengths.

    Raises
    ------
    DiffractionError
        If there are fewer than `FEWEST` maxima.
    """
    found = ridge.found
    response = ridge.response
    if found.sum() < FEWEST:
        raise DiffractionError(
            f"{response.label}: {found.sum()} of {found.size} wavelengths have a maximum on the "
            f"side of order {ridge.order}, too few to fit a period to (at least {FEWEST}); widen "
            "the ranges of angles and wavelengths, or choose another order"
        )
    order = abs(ridge.order)
    wavelength = response.wavelengths[found] * 1e-3
    u = ridge.frequency[found]
    lobe = float(np.median(1.0 / (response.sigma * wavenumber(response.wavelengths))))
    start = float(np.median(u / (order * wavelength)))
    result = least_squares(
        lambda s: u - order * wavelength * s[0], [start], loss="soft_l1", f_scale=lobe,
        x_scale=start, xtol=1e-12, ftol=1e-12, gtol=1e-12,
    )  # fmt: skip
    period = float(1.0 / result.x[0])
    expected = response.beam.grating_angles(response.wavelengths[found], period, ridge.order)
    apart = ridge.angles[found] - expected
    apart = apart[np.isfinite(apart)]
    return Fit(
        period=period,
        residual=float(np.sqrt(np.mean(apart**2))) if apart.size else np.nan,
        largest=float(np.abs(apart).max()) if apart.size else np.nan,
        points=int(found.sum()),
        wavelengths=int(found.size),
    )
