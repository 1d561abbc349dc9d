"""How fine a sum over the spectrum has to be, and how many wavelengths a ray should carry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import delta_e, linear_srgb, response
from ...optics.geometry import diffraction_coordinates, wavenumber
from ...tables.table import DiffractionTable

#: nm between the samples of a sum.
STEPS = (2.0, 5.0, 10.0, 20.0, 40.0)
#: Wavelengths of one ray.
COUNTS = (1, 2, 4, 8, 16)

_FIRST, _LAST, _FINEST = 380.0, 780.0, 0.5  # nm
_DRAWS = 256  # rays for each pair


@dataclass(frozen=True)
class Spectral:
    """Errors of sums, and noise of rays."""

    steps: dict[float, float]  # nm → mean ΔE2000 of a sum with such steps from one of 0.5 nm
    counts: dict[int, float]  # wavelengths of a ray → relative standard deviation of its luminance


def measure_wavelengths(
    table: DiffractionTable, wi: NDArray[np.float64], wo: NDArray[np.float64]
) -> Spectral:
    """From a table, at pairs (n, 3) of directions that it sends light to."""
    lam = np.arange(_FIRST, _LAST, _FINEST) + 0.5 * _FINEST
    spectrum = _spectrum(table, wi, wo, lam)  # (pairs, wavelengths)
    weights = linear_srgb(response(lam))
    exact = spectrum @ weights * _FINEST
    lit = exact.max(axis=1) > 1e-4 * exact.max()
    steps = {}
    for step in STEPS:
        every = round(step / _FINEST)
        chosen = slice(every // 2, None, every)
        sums = spectrum[:, chosen] @ weights[chosen] * step
        steps[step] = float(np.nanmean(delta_e(exact[lit], sums[lit])))
    luminance = spectrum[lit] * response(lam)[:, 1]
    total = luminance.sum(axis=1) * _FINEST
    rng = np.random.default_rng(0)
    counts = {}
    for count in COUNTS:
        # as Mitsuba draws them: one number, shifted by 1/count for each further wavelength
        drawn = (rng.random((_DRAWS, 1)) + np.arange(count) / count) % 1.0
        wavelength, density = _important(drawn)
        found = np.stack(
            [np.interp(wavelength, lam, row, left=0.0, right=0.0) for row in luminance]
        )
        estimate = (found / density).mean(axis=2)
        noise = estimate.std(axis=1) / total
        counts[count] = float(np.sqrt(np.mean(noise**2)))
    return Spectral(steps, counts)


def _spectrum(
    table: DiffractionTable,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    lam: NDArray[np.float64],
) -> NDArray[np.float64]:
    k, (u, v, w) = wavenumber(lam), diffraction_coordinates(wi, wo)
    sums = table.window_sum(k * u[:, None], k * v[:, None], k * w[:, None])
    return sums * (k / k.mean()) ** 2


def _important(u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mitsuba's wavelengths (nm) and their density: after Radziszewski et al. 2009."""
    lam = 538.0 - np.arctanh(0.8569106254698279 - 1.8275019724092267 * u) * 138.88888888888889
    return lam, 0.003939804229326285 / np.cosh(0.0072 * (lam - 538.0)) ** 2
