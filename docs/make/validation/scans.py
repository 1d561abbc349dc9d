"""Scans as parts of a larger surface: hues of gratings, and crops against the whole.

A sinusoid has its orders in closed form (`closed_forms`), seen through the light's window:
exp(−σ²|q − q_m|²). A scan of a sinusoid
that is no whole number of periods must show the same hues. Crops of a rough surface must show the
light of the whole, under the same window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.heights.coherence import usual_window
from mitsuba_diffraction.optics.geometry import sigma_of

from .cases import Grating
from .closed_forms import order_power
from .tapers import Seen

LIGHT = 45.0  # degrees; the detector is at the normal
#: Degrees from the mirror direction of light from 30°, at which crops are compared.
BESIDE = (7.0, 10.0, 15.0, 20.0, 30.0)
_STEP = 2.0  # nm
_FINEST = 0.2  # µm: a pixel that resolves the orders of all wavelengths
#: Angle from the mirror, side of a crop and pixels of the whole: crops of 10 µm of 133 µm.
_CROP, _WHOLE, _PIXEL = 77, 1024, 0.13
#: Width of a crop, µm, and the wavelengths, nm, at which crops are compared.
WIDTH, WAVELENGTHS = _CROP * _PIXEL, np.arange(430.0, 801.0, 20.0)


class Hue(NamedTuple):
    """A peak of a scan against that of the closed form.

    Attributes
    ----------
    hue, peak : relative deviation of the mean wavelength above half the height, and of the highest
        point.
    width : at half height over the ideal one.
    """

    hue: float
    peak: float
    width: float


@dataclass(frozen=True)
class Beside:
    """Crops over the whole at an angle from the mirror direction.

    Attributes
    ----------
    degrees : from the mirror direction.
    seen : mean over crops.
    scatter : standard deviation of one crop's light over the mean.
    error : standard error of the ratio.
    """

    degrees: float
    seen: Seen
    scatter: float
    error: float


def random_hues(count: int = 300, seed: int = 0) -> list[Hue]:
    """Compare random gratings: scans of 10 to 65 µm, 3 to 40 periods, turned by 0 to 45°."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        side, periods, turn = rng.uniform(10, 65), rng.uniform(3, 40), rng.uniform(0, 45)
        along = side / periods * np.sin(np.radians(LIGHT)) * 1e3  # nm: mλ
        orders = [m for m in range(1, 9) if 430.0 < along / m < 730.0]
        if orders:
            order = int(rng.choice(orders))
            found.append(hue(side, side / periods, turn, order, rng.uniform(0, 2 * np.pi)))
    return found


def hue(side: float, period: float, turn: float, order: int, phase: float) -> Hue:
    """Compare the peak of one order of a scan of a sinusoid, in light across its crests."""
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    sine = np.sin(np.radians(LIGHT))
    middle = period * sine * 1e3 / order
    reach = min(0.45 * middle / order, 90.0)
    lam = np.arange(middle - reach, middle + reach, _STEP)
    k, up = 2e3 * np.pi / lam, 1.0 + np.cos(np.radians(LIGHT))
    half = order / (2e3 * np.pi / middle * up)  # µm: as high as this order is strong
    count = max(128, round(side / _FINEST))
    x, y = np.meshgrid(*(np.arange(count) * side / count,) * 2)
    heights = half * np.sin(2 * np.pi * (cos * x + sin * y) / period + phase)
    scan = HeightField(heights, side / count, cut_out=True)
    wi = np.array([cos * sine, sin * sine, up - 1.0])
    seen = reference.brdf(scan, wi, [0.0, 0.0, 1.0], lam)
    sigma = sigma_of(usual_window(side))
    orders = np.arange(-12, 13)[:, None]
    apart = k * sine - 2 * np.pi * orders / period
    powers = order_power(Grating("sinusoidal", period, 2.0 * half), orders, k * up)
    lobes = powers * np.exp(-((sigma * apart) ** 2))
    # 4 cosθi cosθo N/(λ² w²) of a perfect reflector is as smooth as 1/λ²
    ideal = np.sum(lobes[orders[:, 0] != 0], axis=0) / lam**2
    (mean, wide, top), (expected, width, highest) = (_peak(lam, v) for v in (seen, ideal))
    return Hue(mean / expected - 1.0, top / highest - 1.0, wide / width)


def _peak(lam: Real, value: Real) -> tuple[float, float, float]:
    """Mean wavelength above half the height, width at half height, and the highest point, nm."""
    fine = np.arange(lam[0], lam[-1], 0.1)
    curve = np.interp(fine, lam, value)
    top = int(curve.argmax())
    below = np.flatnonzero(curve < 0.5 * curve[top])
    first = below[below < top].max(initial=-1) + 1
    last = below[below > top].min(initial=len(fine))
    upper = slice(first, last)
    mean = float(np.average(fine[upper], weights=curve[upper]))
    return mean, 0.1 * (last - first), float(fine[top])


#: RMS heights, µm, of roughness and ridges.
_ROUGH, _RIDGES = 0.008, 0.012


def _spectra(qx: Real, qy: Real) -> tuple[Real, Real]:
    """Power spectra of roughness and of ridges 0.9 µm apart, on grids of rad/µm, in any unit."""
    rough = (1 + np.square(0.8 * np.hypot(qx, qy))) ** -1.5
    return rough, np.exp(-(((np.abs(qx) - 2 * np.pi / 0.9) / 0.5) ** 2) - qy**2)


def spectrum(qx: Real, qy: Real) -> Real:
    """Power spectrum of the ridged surface."""
    rough, ridges = _spectra(qx, qy)
    return _ROUGH**2 * rough / rough.sum() + _RIDGES**2 * ridges / ridges.sum()


def rough_ridges(rng: np.random.Generator) -> Real:
    """Heights, µm, of ridges 0.9 µm apart on a rough surface that tiles the plane."""
    q = 2 * np.pi * np.fft.fftfreq(_WHOLE, _PIXEL)

    def noise(power: Real) -> Real:
        waves = np.fft.fft2(rng.normal(size=(_WHOLE, _WHOLE))) * np.sqrt(power)
        heights = np.fft.ifft2(waves).real
        return heights / heights.std()

    rough, ridges = map(noise, _spectra(*np.meshgrid(q, q)))
    return _ROUGH * rough + _RIDGES * ridges


def crops(
    count: int = 240, degrees: Sequence[float] = BESIDE, wavelengths: Real | None = None,
    surfaces: int = 4,
) -> list[Beside]:  # fmt: skip
    """Compare levelled crops of 10 µm with the wholes, 133 µm, under one window.

    Crops of one surface share its strong waves: `count` crops are of several `surfaces`.
    """
    rng = np.random.default_rng(5)
    parts, wholes = [], []
    for _ in range(surfaces):
        heights = rough_ridges(rng)
        wholes.append(HeightField(heights, _PIXEL, periodic=True))
        for _ in range(count // surfaces):
            top, left = rng.integers(0, _WHOLE - _CROP, 2)
            cut = heights[top : top + _CROP, left : left + _CROP]
            parts.append(HeightField(cut, _PIXEL, cut_out=True).treated(level="plane"))
    lam = WAVELENGTHS if wavelengths is None else wavelengths
    incident, results = np.radians(30.0), []
    wi = [np.sin(incident), 0.0, np.cos(incident)]
    for off in degrees:
        out = np.radians(30.0 - off)
        wo = [-np.sin(out), 0.0, np.cos(out)]
        values = [
            reference.brdf(field, wi, wo, lam, coherence_width=WIDTH) for field in (*wholes, *parts)
        ]
        exact, cuts = np.mean(values[:surfaces], axis=0), np.array(values[surfaces:])
        scatter = float(np.std(np.mean(cuts, axis=1)) / exact.mean())
        seen = Seen.between(np.mean(cuts, axis=0), exact)
        results.append(Beside(off, seen, scatter, scatter / np.sqrt(len(parts))))
    return results
