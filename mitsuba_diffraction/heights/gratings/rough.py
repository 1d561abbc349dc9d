"""Rough mirrors: isotropic Gaussian heights of a power spectrum, as polishing leaves them."""

from __future__ import annotations

import numpy as np

from ...errors import DiffractionError
from ..field import HeightField
from ..lengths import Counts, Lengths, count_pair, length_pair, number_between, seed_of
from .noise import rounded


def rough(
    extent: Lengths = 65.0,
    pixels: Counts = 704,
    seed: int = 0,
    *,
    rms: float = 0.005,
    correlation: float = 2.0,
    slope: float = 1.5,
    band: tuple[float, float] | None = None,
) -> HeightField:
    """Generate a rough mirror with a K-correlation spectrum (ABC model) and an exact RMS height.

    The power spectral density over spatial frequency f is S₂(f) ∝ (1 + (2π l f)²)^(−(C+1)/2), of a
    line across the surface S₁(f) ∝ (1 + (2π l f)²)^(−C/2) (Church and Takacs 1991, Proc. SPIE 1530,
    71; Stover, Optical Scattering, 3rd ed., eq. 2.21). With a correlation length far above the
    patch it is a fractal: S₁ ∝ f^(−C).

    Raises a DiffractionError if a parameter is out of its range, or no spatial wavelength of the
    patch lies in the band.

    Parameters
    ----------
    extent
        Size in µm, one length or (along x, along y), 1 to 5000.
    pixels
        Samples, one count or (along x, along y).
    seed
        A whole number; each seed is another piece.
    rms
        Root mean square height of the patch, µm.
    correlation
        l, µm: B = 2πl of the ABC model.
    slope
        C, the exponent of S₁ at high frequencies, 0.1 to 6.
    band
        Shortest and longest spatial wavelength, µm; by default all of the patch.
    """
    size = length_pair(extent, "rough: extent", 1.0, 5000.0)
    nx, ny = count_pair(pixels, "rough: pixels", 8, 8192)
    height = number_between(rms, "rough: rms", 0.0, 2.0, " µm")
    length = number_between(correlation, "rough: correlation", 1e-3, 1e6, " µm")
    exponent = number_between(slope, "rough: slope", 0.1, 6.0)
    rng = np.random.default_rng(seed_of(seed, "rough: seed"))
    fx = np.fft.rfftfreq(nx, size[0] / nx)
    fy = np.fft.fftfreq(ny, size[1] / ny)[:, None]
    frequency = np.hypot(fx, fy)
    amplitude = (1.0 + (2.0 * np.pi * length * frequency) ** 2) ** (-(exponent + 1.0) / 4.0)
    amplitude[0, 0] = 0.0
    if band is not None:
        least, most = (number_between(end, "rough: band", 1e-3, 1e5, " µm") for end in band)
        amplitude *= (frequency >= 1.0 / most) & (frequency <= 1.0 / least)
        if not amplitude.any():
            raise DiffractionError(
                f"rough: band={least:g}, {most:g} µm has no spatial wavelength of this patch, "
                f"{max(size):g} µm wide with pixels of {size[0] / nx:g} µm"
            )
    heights = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((ny, nx))) * amplitude, (ny, nx))
    heights *= height / max(float(heights.std()), 1e-300)
    pixel = size[0] / nx, size[1] / ny
    return HeightField(rounded(heights), pixel, name="rough", periodic=True)
