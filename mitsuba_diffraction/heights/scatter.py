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
from .field import HeightField
from .spectra import frequencies, height_spectrum

#: Rings of spatial frequency for each octave.
_RINGS = 6
#: Largest (4πσ/λ)² of heights that are far below the wavelength.
_MOST_SCATTER = 0.1
#: Fewest rings that an ABg model is fitted to.
_FEWEST = 5
#: RMS relative difference from the spectrum above which a model describes nothing.
WORST_FIT = 1.0


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


def power_spectrum(field: HeightField) -> PowerSpectrum:
    """Return the power spectrum of a patch.

    Raises a DiffractionError if the patch has too few pixels.
    """
    density = height_spectrum(field, windowed=not field.periodic)
    fx, fy = frequencies(field)
    radius = np.hypot(fx, fy)
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    low, high = 1.0 / min(nx * dx, ny * dy), 0.5 / max(dx, dy)
    inside = (radius >= 0.999 * low) & (radius <= high)
    if not inside.any():
        raise DiffractionError(f"{field.name} has too few pixels for a power spectrum")
    ring = np.floor(_RINGS * np.log2(radius[inside] / (0.999 * low))).astype(int)
    counts = np.bincount(ring)
    known = counts > 0
    middle, mean = (
        np.bincount(ring, part[inside])[known] / counts[known] for part in (radius, density)
    )
    cell = 1.0 / (nx * dx * ny * dy)
    power = density[inside] * cell
    slope = float(np.sqrt((power * (2.0 * np.pi * radius[inside]) ** 2).sum()))
    rms, band = float(np.sqrt(power.sum())), (1.0 / high, 1.0 / low)
    return PowerSpectrum(middle, mean, counts[known], rms, slope, band)


def rayleigh_rice_scatter(field: HeightField, wavelength: float) -> float:
    """Return the total integrated scatter of a mirror at normal incidence, over its reflectance.

    ∫ (16π²/λ²) cosθ S₂ d²f over f < 1/λ: (4πσ/λ)² of a smooth, slowly varying surface. Warns
    where that exceeds 0.1: the theory is of its first power.

    wavelength : nm.
    """
    lam = 1e-3 * wavelength
    if (scatter := (4.0 * np.pi * float(field.heights.std()) / lam) ** 2) > _MOST_SCATTER:
        warn(
            f"{field.name}: (4πσ/λ)² is {scatter:.2g} at {wavelength:g} nm, and Rayleigh-Rice "
            f"theory is for at most {_MOST_SCATTER:g}; go by the scatter of the table"
        )
    fx, fy = frequencies(field)
    cosine = np.sqrt(np.maximum(1.0 - lam**2 * (fx**2 + fy**2), 0.0))
    density = height_spectrum(field, windowed=not field.periodic)
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    return float((16.0 * np.pi**2 / lam**2 * cosine * density).sum() / (nx * dx * ny * dy))


def abg_model(spectrum: PowerSpectrum, wavelength: float) -> ABg | None:
    """Fit the ABg model to a spectrum at a wavelength, nm, in logarithms over its modes.

    Return None if its error exceeds `WORST_FIT`, as of gratings and of bands of roughness.

    Raises a DiffractionError if the heights are flat, or fewer than five rings of the spectrum
    scatter the light.
    """
    if spectrum.rms == 0.0:
        raise DiffractionError("the heights are flat and scatter no light; an ABg model needs some")
    lam = 1e-3 * wavelength
    beta = lam * spectrum.frequency
    used = (beta < 1.0) & (spectrum.density > 0.0)
    if used.sum() < _FEWEST:
        raise DiffractionError(
            f"{wavelength:g} nm: the spectrum from {spectrum.band[0]:.3g} to "
            f"{spectrum.band[1]:.3g} µm has {counted(int(used.sum()), 'ring')} within sin θ < 1, "
            f"and an ABg model needs {_FEWEST}; take a larger patch, or a shorter wavelength"
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
    if error > WORST_FIT:
        return None
    a, b, g = float(np.exp(fit.x[0])), float(np.exp(fit.x[1])), float(fit.x[2])
    return ABg(a, b, g, (float(beta[0]), float(beta[-1])), error)
