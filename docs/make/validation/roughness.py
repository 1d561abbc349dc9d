"""Random surfaces whose mean diffraction is known in closed form.

For heights with a Gaussian distribution of standard deviation `rms` and the autocorrelation
rms²·exp(−r²/T²), the mean power of the phase screen exp(iκh) at spatial frequency q is, with
g = (κ·rms)², a coherent part exp(−g) at q = 0 and the density

    S(q) = exp(−g) Σ_{n≥1} gⁿ/(n!·n) · πT² · exp(−q²T²/4n)

(Beckmann and Spizzichino 1963, section 5.3). Seen through the window, whose power
spectrum is a Gaussian exp(−σ²q²), both broaden; Gaussians convolve to Gaussians, so the sum stays
closed. The coherent part is the mirror's lobe of docs/theory.md, eq. 10.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaln

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.optics.geometry import (
    diffraction_coordinates,
    kirchhoff_factor,
    sigma_of,
    wavenumber,
)
from mitsuba_diffraction.optics.mirror import horizon_correction

# gⁿ/n! falls below the last bit by n = g + 9√g + 40 for every g
_EXTRA_TERMS, _SPREAD = 40, 9


@dataclass(frozen=True)
class Roughness:
    """A random surface: standard deviation of the heights and correlation length T, µm."""

    rms: float
    correlation: float

    def patch(self, extent: float, pixels: int, seed: int) -> HeightField:
        """Surface of `extent` µm and `pixels`² pixels that tiles; equal for equal seeds.

        White noise filtered to the autocorrelation exactly, so that heights are Gaussian, and
        their mean square over all seeds is rms² (a single patch's is not, nor its mean 0).
        """
        step = extent / pixels
        q2 = np.add.outer(*(2 * [(2 * np.pi * np.fft.fftfreq(pixels, step)) ** 2]))
        power = np.exp(-q2 * self.correlation**2 / 4)
        amplitude = np.sqrt(power * pixels**2 / power.sum())
        noise = np.random.default_rng(seed).standard_normal((pixels, pixels))
        heights = self.rms * np.fft.ifft2(np.fft.fft2(noise) * amplitude).real
        return HeightField(heights, step, name=f"roughness, seed {seed}")

    @property
    def rms_slope(self) -> float:
        """Root-mean-square slope of the surface, 2·rms/T."""
        return 2 * self.rms / self.correlation


def mean_order_0(roughness: Roughness, kappa: float, extent: float) -> float:
    """Mean |a_0|² of patches `extent` µm wide: exp(−g), and what is scattered into that bin.

    A bin is (2π/extent)² wide, and the mean power in it S(0)/extent². κ in rad/µm.
    """
    g = (kappa * roughness.rms) ** 2
    n = np.arange(1, _terms(g) + 1)
    series = np.sum(np.exp(n * np.log(g) - gammaln(n + 1) - g) / n)
    return float(np.exp(-g) + series * np.pi * roughness.correlation**2 / extent**2)


def mean_brdf(
    roughness: Roughness,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    coherence_width: float,
) -> Real:
    """BRDF (R = 1) averaged over all such surfaces, in closed form; arguments as
    `reference.brdf` takes them, shape (n,) in 1/sr.
    """
    sigma, k = sigma_of(coherence_width), wavenumber(wavelength)
    u, v, w = diffraction_coordinates(wi, wo)
    q2 = (k * u) ** 2 + (k * v) ** 2
    g = (k * w * roughness.rms) ** 2
    power, weight = np.zeros_like(g), np.exp(-g)
    for n in range(1, _terms(float(np.max(g))) + 1):
        weight = weight * g / n
        # ∫ S(q') exp(−σ²|q − q'|²) d²q'/4π², a Gaussian of variances T²/4n and σ² combined
        narrow = roughness.correlation**2 / (4 * n)
        total = sigma**2 + narrow
        power += weight * narrow / total * np.exp(-q2 * sigma**2 * narrow / total)
    factor = kirchhoff_factor(wi, wo, wavelength, sigma)
    # the coherent part, order 0: a mirror's lobe
    cos_i, cos_o = (np.asarray(each)[..., 2] for each in (wi, wo))
    visible = horizon_correction(sigma * cos_i**2, sigma * cos_o**2, k)
    coherent = (k * sigma) ** 2 / np.pi * visible * np.exp(-g - sigma**2 * q2)
    return np.asarray(factor * 4 * np.pi**2 * sigma**4 * power + coherent)


def _terms(g: float) -> int:
    return int(np.ceil(g + _SPREAD * np.sqrt(g))) + _EXTRA_TERMS


def shifted(field: HeightField, count: int, seed: int = 0) -> Iterator[HeightField]:
    """Yield a field that is cut anew at random places (it tiles), where its window is then."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        shift = tuple(int(rng.integers(0, n)) for n in field.shape)
        yield HeightField(np.roll(field.heights, shift, (0, 1)), field.pixel_size)
