"""Costs of estimators of a scan's light: width of lobes against light from strong waves far away.

Both follow from the transform T of a window's taper. A wave of frequency q₀ has the lobe
Σ_j P_j exp(−σ_l²(q − q_j)²) over the orders q_j, π/W apart, of a window of width W, with
P_j = |T(q_j − q₀)|², from which neighbours take a share b. Light of low relief is κ² S(q), with S
the power spectrum of the heights (J. C. Stover, Optical Scattering, SPIE, section 4.3): seen
through windows, S convolved with the mean lobe.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import i0

from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.heights.coherence import LOOKUP, SHARPENING, TAPER

#: Taper at places u from −1 to 1, the window's edges.
Taper = Callable[[Real], Real]


def gaussian(width: float) -> Taper:
    """Gaussian of σ_t = `width` σ, with the window 4σ wide."""
    return lambda u: np.exp(-0.5 * np.square(2.0 * u / width))


def kaiser(beta: float) -> Taper:
    """Kaiser's taper, nearly the most concentrated of all (IEEE ISCAS 20, 1974)."""
    return lambda u: i0(beta * np.sqrt(np.maximum(1.0 - u * u, 0.0))) / i0(beta)


def cosines(*shares: float) -> Taper:
    """1 + Σ c_n cos nπu."""
    return lambda u: 1.0 + sum(c * np.cos(n * np.pi * u) for n, c in enumerate(shares, 1))


@dataclass(frozen=True)
class Estimator:
    """How a scan's light is estimated.

    Attributes
    ----------
    taper : of a window.
    lookup : σ_l over σ.
    sharpening : b.
    """

    taper: Taper
    lookup: float = 2.0
    sharpening: float = 0.0

    def orders(self, q: Real, width: float) -> Real:
        """Return the mean power of orders by their distance q from a wave, rad/µm."""
        apart = np.pi / width
        power, left, right = (
            _transform(self.taper, width, q + n * apart) for n in (0.0, -1.0, 1.0)
        )
        return power - self.sharpening * (left - 2.0 * power + right)


#: The package's estimator first.
ESTIMATORS = {
    "package": Estimator(cosines(*TAPER), LOOKUP, SHARPENING),
    "package, without sharpening": Estimator(cosines(*TAPER), LOOKUP),
    "package's taper, σ_l = 2σ": Estimator(cosines(*TAPER)),
    "Gaussian, σ_t = 1.155 σ": Estimator(gaussian(2.0 / np.sqrt(3.0))),
    "Gaussian, σ_t = 1.4 σ": Estimator(gaussian(1.4)),
    "Kaiser, β = 3": Estimator(kaiser(3.0)),
    "Kaiser, β = 3.5": Estimator(kaiser(3.5)),
    "cosine": Estimator(lambda u: np.cos(0.5 * np.pi * u)),
}


@dataclass(frozen=True)
class Seen:
    """Light of windows or crops over that of the whole through the light's Gaussian window.

    Attributes
    ----------
    ratio : of the mean over wavelengths.
    worst : largest ratio at a wavelength, or its inverse.
    """

    ratio: float
    worst: float

    @classmethod
    def between(cls, light: Real, whole: Real) -> Seen:
        """Compare light with that of the whole by wavelength."""
        worst = np.exp(np.abs(np.log(light / whole)).max())
        return cls(float(light.mean() / whole.mean()), float(worst))


def lobe_widths(estimator: Estimator, count: int = 300) -> Real:
    """Width at half height of lobes over the ideal one, of waves at random angles and places."""
    rng, width, found = np.random.default_rng(0), 4.0, []
    q = np.linspace(-4.0, 4.0, 801)
    ideal = _half_width(q, np.exp(-np.square(q)))
    for turn in rng.uniform(0.0, 0.25 * np.pi, count):
        lobe = np.ones(len(q))
        for along in (np.cos(turn) * q, np.sin(turn) * q):
            orders = (np.arange(-12, 13) + rng.uniform()) * np.pi / width
            weights = np.exp(-np.square(estimator.lookup * (along[:, None] - orders)))
            lobe *= weights @ estimator.orders(orders, width)
        found.append(_half_width(q, lobe) / ideal)
    return np.array(found)


def seen(estimator: Estimator, spectrum: Callable[[Real, Real], Real], width: float,
         degrees: float, lam: Real) -> Seen:  # fmt: skip
    """Return the light of a spectrum at an angle from the mirror, for light from 30°.

    spectrum : S(qx, qy), rad/µm, on grids.
    width : W = 4σ, µm.
    lam : wavelengths, nm.
    """
    sigma, step = 0.25 * width, 0.04
    q = step * np.arange(-600, 601)  # odd in number: the convolution keeps the middle
    surface = spectrum(*np.meshgrid(q, q))
    lookup = np.exp(-np.square(estimator.lookup * sigma * q))
    lobe = np.convolve(estimator.orders(q, width), lookup, "same")
    ideal = np.exp(-np.square(sigma * q))
    light, out = np.radians(30.0), np.radians(30.0 - degrees)
    values = []
    for wavelength in lam * 1e-3:
        k = 2.0 * np.pi / wavelength
        at = k * (np.sin(light) - np.sin(out))
        columns = np.clip(np.round((at - q - q[0]) / step).astype(int), 0, len(q) - 1)
        near = surface[:, columns]
        kappa = k * (np.cos(light) + np.cos(out))
        values.append([kappa**2 * (e @ (near @ e)) / e.sum() ** 2 for e in (lobe, ideal)])
    return Seen.between(*np.array(values).T)


def _transform(taper: Taper, width: float, q: Real) -> Real:
    """|T(q)|² of a taper over a window, q in radians over the unit of the width."""
    x = 0.5 * width * np.linspace(-1.0, 1.0, 401)
    weights = taper(2.0 * x / width)
    return np.array([np.trapezoid(weights * np.cos(each * x), x) for each in q]) ** 2


def _half_width(q: Real, lobe: Real) -> float:
    """Width at half height."""
    half, top = 0.5 * lobe.max(), int(lobe.argmax())
    left = np.interp(half, lobe[: top + 1], q[: top + 1])
    right = np.interp(-half, -lobe[top:], q[top:])
    return float(right - left)
