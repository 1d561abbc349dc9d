"""Scatter of a rough mirror from its heights: power spectrum, total integrated scatter, ABg model.

Rayleigh-Rice theory (Stover, Optical Scattering, 3rd ed., ch. 4; ISO 10110-8 for the spectra):
at normal incidence the BRDF over the reflectance is (16π²/λ⁴) cosθ S₂(f), at f = sinθ/λ, with the
factor of polarisation Q taken as R. It holds for heights far below the wavelength.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..arrays import Real
from ..errors import DiffractionError, counted, warn
from ..settings import TableSettings
from .field import HeightField
from .spectra import frequencies, height_spectrum

#: Rings of spatial frequency for each octave.
_RINGS = 6
#: Largest (4πσ/λ)² of heights that are far below the wavelength.
_MOST_SCATTER = 0.1
#: Fewest rings that an ABg model is fitted to.
_FEWEST = 5
# RMS relative difference from the spectrum above which a model describes nothing.
_WORST_FIT = 1.0
# Fewest periods in a window of a scan: of two, an eighth of a bow's power is left beside the
# mirror's lobe, and windows of spectrum and table agree to some 10 %; of one, to a factor of two.
_PERIODS = 2.0
# Frequencies on the edge of a band are in it.
_ALMOST = 0.999


class PowerSpectrum(NamedTuple):
    """Power spectral density of heights, averaged over azimuths.

    Attributes
    ----------
    frequency : (n,) 1/µm, means of rings that are even in octaves.
    density : (n,) two-dimensional, S₂ in µm⁴; ∫ S₂ d²f is the variance.
    modes : (n,) number of frequencies of a ring, each of which scatters by 100 %.
    rms, slope : RMS height, µm, and RMS slope of the band.
    band : shortest and longest spatial wavelength, µm.
    """

    frequency: Real
    density: Real
    modes: NDArray[np.int64]
    rms: float
    slope: float
    band: tuple[float, float]


class Scatter(NamedTuple):
    """Total integrated scatter at normal incidence, over the reflectance, and its roughness.

    Attributes
    ----------
    share : of the reflected light.
    rms : RMS height of the band, µm.
    band : shortest and longest spatial wavelength that scatters, µm.
    """

    share: float
    rms: float
    band: tuple[float, float]


class ABg(NamedTuple):
    """ABg model of a BRDF, A/(B + |β − β₀|^g) in 1/sr, over the reflectance.

    Attributes
    ----------
    range : least and largest |β − β₀| that it is fitted to.
    error : RMS relative difference from the spectrum there, over its modes.
    """

    a: float
    b: float
    g: float
    range: tuple[float, float]
    error: float


def longest_of(settings: TableSettings) -> float | None:
    """Return the longest spatial wavelength, µm, that windows of a scan tell from its form.

    None of patches that tile the plane, whose orders are apart from the mirror direction.

    settings : resolved, of the scan's table.
    """
    return None if settings.taper_width is None else settings.width / _PERIODS


def power_spectrum(field: HeightField, longest: float | None = None) -> PowerSpectrum:
    """Return the power spectrum of a patch.

    longest : longest spatial wavelength, µm; None for the larger side of the patch.

    Raises a DiffractionError if the patch has too few pixels.
    """
    radius, density, cell, band = _modes(field, longest)
    ring = np.floor(_RINGS * np.log2(radius * band[1] / _ALMOST)).astype(int)
    counts = np.bincount(ring)
    known = counts > 0
    middle, mean = (np.bincount(ring, part)[known] / counts[known] for part in (radius, density))
    slope = float(np.sqrt((density * (2.0 * np.pi * radius) ** 2).sum() * cell))
    rms = float(np.sqrt(density.sum() * cell))
    return PowerSpectrum(middle, mean, counts[known], rms, slope, band)


def rayleigh_rice_scatter(
    field: HeightField, wavelength: float, longest: float | None = None
) -> Scatter:
    """Return the total integrated scatter of a mirror at normal incidence.

    ∫ (16π²/λ²) cosθ S₂ d²f over f < 1/λ: (4πσ/λ)² of a smooth, slowly varying surface. Warns
    where that exceeds 0.1: the theory is of its first power.

    wavelength : nm.
    longest : as of `power_spectrum`.

    Raises a DiffractionError as `power_spectrum` does, and if no wave of the band scatters light.
    """
    lam = 1e-3 * wavelength
    if longest is not None and longest <= lam:
        raise DiffractionError(
            f"{field.name}: the scatter of {wavelength:g} nm is unknown: waves in the heights "
            f"longer than {lam:.3g} µm scatter it, and this scan tells waves up to {longest:.3g} "
            f"µm from form; take a scan more than {lam / longest:.2g} times as wide, or a shorter "
            "wavelength"
        )
    if (scatter := (4.0 * np.pi * float(field.heights.std()) / lam) ** 2) > _MOST_SCATTER:
        warn(
            f"{field.name}: (4πσ/λ)² is {scatter:.2g} at {wavelength:g} nm, and Rayleigh-Rice "
            f"theory is for at most {_MOST_SCATTER:g}; go by the scatter of the table"
        )
    radius, density, cell, band = _modes(field, longest)
    square = 1.0 - (lam * radius) ** 2
    power = density[square > 0.0] * cell
    share = float((16.0 * np.pi**2 / lam**2 * np.sqrt(square[square > 0.0]) * power).sum())
    return Scatter(share, float(np.sqrt(power.sum())), (max(lam, band[0]), band[1]))


def _modes(
    field: HeightField, longest: float | None
) -> tuple[Real, Real, float, tuple[float, float]]:
    """Return frequencies (n,) of a band, 1/µm, their S₂ (n,), the area of each, and the band."""
    fx, fy = frequencies(field)
    radius = np.hypot(fx, fy)
    (width, height), shortest = field.extent, 2.0 * max(field.pixel_size)
    band = shortest, longest or max(width, height)
    inside = (radius >= _ALMOST / band[1]) & (radius <= 1.0 / band[0])
    if not inside.any():
        raise DiffractionError(f"{field.name} has too few pixels for a power spectrum")
    density = height_spectrum(field, windowed=not field.periodic)
    return radius[inside], density[inside], 1.0 / (width * height), band


def abg_model(spectrum: PowerSpectrum, wavelength: float) -> ABg:
    """Fit the ABg model to a spectrum at a wavelength, nm, in logarithms over its modes.

    Raises a DiffractionError if the heights are flat, fewer than five rings of the spectrum
    scatter the light, or the model's error exceeds 100 %, as of gratings.
    """
    if spectrum.rms == 0.0:
        raise DiffractionError("the heights are flat and scatter no light")
    lam = 1e-3 * wavelength
    beta = lam * spectrum.frequency
    used = (beta < 1.0) & (spectrum.density > 0.0)
    if used.sum() < _FEWEST:
        raise DiffractionError(
            f"the spectrum from {spectrum.band[0]:.3g} to {spectrum.band[1]:.3g} µm has "
            f"{counted(int(used.sum()), 'ring')} within sin θ < 1, and the model needs {_FEWEST}; "
            "take a larger patch, or a shorter wavelength"
        )
    beta = beta[used]
    # rings of few modes are known least
    weight = np.sqrt(spectrum.modes[used] / spectrum.modes[used].sum())
    brdf = 16.0 * np.pi**2 / lam**4 * spectrum.density[used]

    def residuals(parameters: Real) -> Real:
        log_a, log_b, g = parameters
        return np.asarray(weight * (log_a - np.log(np.exp(log_b) + beta**g) - np.log(brdf)))

    start = (float(np.log(brdf[-1] * beta[-1] ** 2)), 2.0 * float(np.log(beta[0])), 2.0)
    limits = ([-80.0, -60.0, 0.0], [80.0, 5.0, 8.0])
    fit = least_squares(residuals, np.clip(start, *limits), bounds=limits)
    error = float(np.sqrt(np.sum((weight * np.expm1(fit.fun / weight)) ** 2)))
    if error > _WORST_FIT:
        raise DiffractionError(
            f"the spectrum is {error:.0%} RMS off the nearest one, more than {_WORST_FIT:.0%}: it "
            "has peaks or a band, as of a grating, and the model one slope; use the spectrum itself"
        )
    a, b, g = float(np.exp(fit.x[0])), float(np.exp(fit.x[1])), float(fit.x[2])
    return ABg(a, b, g, (float(beta[0]), float(beta[-1])), error)
