"""Costs of a taper of a scan's windows: width of lobes against light from strong waves far away.

Both follow from the taper's transform T alone. A wave of frequency q₀ has the lobe
Σ_j |T(q_j − q₀)|² exp(−σ_l²(q − q_j)²) over the orders q_j, π/W apart, of a window of width W.
Light of low relief is κ² S(q), with S the power spectrum of the heights (J. C. Stover, Optical
Scattering, SPIE, section 4.3): seen through windows, S convolved with the mean lobe.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0

Real = NDArray[np.float64]
#: Taper at places u from −1 to 1, the window's edges.
Taper = Callable[[Real], Real]


def gaussian(width: float) -> Taper:
    """Gaussian of σ_t = `width` σ, with the window 4σ wide."""
    return lambda u: np.exp(-0.5 * np.square(2.0 * u / width))


def kaiser(beta: float) -> Taper:
    """Kaiser's taper, nearly the most concentrated of all (IEEE ISCAS 20, 1974)."""
    return lambda u: i0(beta * np.sqrt(np.maximum(1.0 - u * u, 0.0))) / i0(beta)


def tukey(share: float) -> Taper:
    """Flat, with cosines over a `share` of the window at its ends."""
    return lambda u: np.where(
        np.abs(u) < 1.0 - share, 1.0, 0.5 + 0.5 * np.cos(np.pi * (np.abs(u) - 1.0 + share) / share)
    )


#: The package's taper first.
TAPERS: dict[str, Taper] = {
    "Gaussian, σ_t = 1.155 σ": gaussian(2.0 / np.sqrt(3.0)),
    "Gaussian, σ_t = 1.4 σ": gaussian(1.4),
    "Kaiser, β = 2.5": kaiser(2.5),
    "Kaiser, β = 3": kaiser(3.0),
    "Kaiser, β = 3.5": kaiser(3.5),
    "Tukey, 30 %": tukey(0.3),
    "Tukey, 50 %": tukey(0.5),
    "cosine": lambda u: np.cos(0.5 * np.pi * u),
}


@dataclass(frozen=True)
class Seen:
    """Light of low relief through windows over that through the light's Gaussian window.

    Attributes
    ----------
    ratio : of the mean over wavelengths.
    worst : largest ratio at a wavelength, or its inverse.
    """

    ratio: float
    worst: float


def lobe_widths(taper: Taper, places: int = 21) -> Real:
    """Width at half height of a lobe over the ideal one, for orders at `places` beside the wave."""
    sigma, width = 1.0, 4.0
    q = np.linspace(-4.0, 4.0, 4001)
    ideal = _half_width(q, np.exp(-np.square(sigma * q)))
    found = []
    for offset in np.linspace(0.0, 1.0, places, endpoint=False):
        orders = (np.arange(-40, 41) + offset) * np.pi / width
        power = _transform(taper, width, orders)[:, None]
        lobe = np.sum(power * np.exp(-np.square(2.0 * sigma * (q - orders[:, None]))), axis=0)
        found.append(_half_width(q, lobe) / ideal)
    return np.array(found)


def seen(taper: Taper, spectrum: Callable[[Real, Real], Real], width: float, degrees: float,
         lam: Real) -> Seen:  # fmt: skip
    """Return the light of a spectrum at an angle from the mirror, for light from 30°.

    spectrum : S(qx, qy), rad/µm, on grids.
    width : W = 4σ, µm.
    lam : wavelengths, nm.
    """
    sigma, step = 0.25 * width, 0.04
    q = np.arange(-24.0, 24.0, step)
    surface = spectrum(*np.meshgrid(q, q))
    lookup = np.exp(-np.square(2.0 * sigma * q))
    lobe = np.convolve(_transform(taper, width, q), lookup, "same")
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
    ours, exact = np.array(values).T
    return Seen(
        float(ours.mean() / exact.mean()), float(np.exp(np.abs(np.log(ours / exact)).max()))
    )


def _transform(taper: Taper, width: float, q: Real) -> Real:
    """|T(q)|² of a taper over a window, q in radians over the unit of the width."""
    x = 0.5 * width * np.linspace(-1.0, 1.0, 2001)
    weights = taper(2.0 * x / width)
    return np.array([np.trapezoid(weights * np.cos(each * x), x) for each in q]) ** 2


def _half_width(q: Real, lobe: Real) -> float:
    """Width at half height."""
    half, top = 0.5 * lobe.max(), int(lobe.argmax())
    left = np.interp(half, lobe[: top + 1], q[: top + 1])
    right = np.interp(-half, -lobe[top:], q[top:])
    return float(right - left)
