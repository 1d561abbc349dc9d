"""Random surfaces: rough mirrors, as polishing leaves them, and lines.

Lines are brushed, ground and laser-rippled metal, and the lines of a lathe.
"""

from __future__ import annotations

import numpy as np

from ...errors import DiffractionError
from ..field import HeightField
from ..lengths import number_between
from .noise import Counts, Lengths, grain, grid, patch


def brushed(
    extent: Lengths = 65.0,
    pixels: Counts = 704,
    seed: int = 0,
    *,
    rms: float = 0.08,
    width: float = 1.0,
    length: float = 15.0,
    period: float | None = None,
) -> HeightField:
    """Generate a Gaussian field of lines along y; with a period, lines that nearly repeat along x.

    Heights are white noise blurred by Gaussians of the widths `width` and `length`. With a period
    two such fields modulate a cosine and a sine along x, which makes a band of spatial frequencies.

    Raises a DiffractionError if a parameter is out of its range.

    Parameters
    ----------
    extent
        Size in µm, one length or (along x, along y), 4 to 500.
    pixels
        Samples, one count or (along x, along y); at least four to `width` and to the period.
    seed
        A whole number; each seed is another piece.
    rms
        Root mean square height, µm.
    width, length
        σ of the blur along x and y, µm: the width of a line, or with a period the distance over
        which lines keep step; and the length of a line.
    period
        Mean distance of lines, µm, adjusted so that whole numbers of them fit; None for no period.
    """
    size, (ny, nx), seeds = grid("brushed", extent, pixels, seed, (4.0, 500.0))
    amplitude = number_between(rms, "brushed: rms", 0.0, 2.0, " µm")
    least = 4.0 * size[0] / nx if period is None else 0.0
    across = number_between(width, "brushed: width", least, size[0] / 4, " µm")
    along = number_between(length, "brushed: length", 0.0, size[1] / 4, " µm")
    rng = np.random.default_rng(seeds)
    heights = grain(rng, size, (ny, nx), (across, along))
    if period is not None:
        distance = number_between(period, "brushed: period", 4 * size[0] / nx, size[0] / 4, " µm")
        phase = 2 * np.pi * round(size[0] / distance) * np.arange(nx) / nx
        other = grain(rng, size, (ny, nx), (across, along))
        heights = heights * np.cos(phase) + other * np.sin(phase)
    return patch("brushed", amplitude * (heights - heights.mean()), size)


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
    size, (ny, nx), seeds = grid("rough", extent, pixels, seed, (1.0, 5000.0))
    height = number_between(rms, "rough: rms", 0.0, 2.0, " µm")
    length = number_between(correlation, "rough: correlation", 1e-3, 1e6, " µm")
    exponent = number_between(slope, "rough: slope", 0.1, 6.0)
    rng = np.random.default_rng(seeds)
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
    return patch("rough", heights, size, periodic=True)
