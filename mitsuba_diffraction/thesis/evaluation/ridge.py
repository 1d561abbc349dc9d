"""The ridge of maxima, and the period for which the grating equation runs along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...errors import DiffractionError
from ...optics.geometry import wavenumber
from .beam import Array, Response

#: Fewer maxima than this determine no period.
FEWEST = 5

# In units of 1/σ: beyond it exp(−25), 1e-11, is left of order 0's power.
_ORDER_0 = 5.0
# Light this much weaker than the brightest order is the window's own tail, not a maximum.
_FAINT = 1e-12


@dataclass(frozen=True, eq=False)
class Ridge:
    """Viewing angle of the maximum at each wavelength.

    Attributes
    ----------
    response : where it was found.
    order : whose it is.
    angles : (L,), degrees; NaN where there is none.
    heights : (L,), f·cosθo there, 1/sr.
    """

    response: Response
    order: int
    angles: Array
    heights: Array

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
    """The grating equation, fitted to a ridge.

    Attributes
    ----------
    period : µm.
    residual : degrees, root mean square of ridge less grating equation.
    largest : degrees, the largest difference.
    points, wavelengths : maxima that were found, of how many wavelengths.
    """

    period: float
    residual: float
    largest: float
    points: int
    wavelengths: int


def ridge_of(response: Response, order: int = 1) -> Ridge:
    """At each wavelength, where the patch sends most light on the side of that order.

    Order 0 is left out up to where its lobe ends, |u| = 5/(σk), and so is the other side of it: the
    brightest point of what remains is taken, as in the thesis, between samples by a
    parabola through the logarithms of three neighbours, which is exact for a Gaussian lobe. A
    maximum at the end of the range is none.

    Raises
    ------
    DiffractionError
        If `order` is 0.
    """
    if order == 0:
        raise DiffractionError("order=0 is the mirror's, at every wavelength; give 1, -1, 2, ...")
    u = response.beam.sine + np.sin(np.radians(response.angles))
    lobe = _ORDER_0 / (response.sigma * wavenumber(response.wavelengths))
    allowed = np.sign(order) * u[None, :] > lobe[:, None]
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
