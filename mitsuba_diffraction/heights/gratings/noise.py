"""Periodic random fields: the irregular part of a natural surface."""

from __future__ import annotations

import math

import numpy as np
import scipy

from ...arrays import Real

Rng = np.random.Generator
#: Lengths along x and y, µm.
Pair = tuple[float, float]
#: Numbers of pixels (ny, nx).
Shape = tuple[int, int]


def smooth_field(
    rng: Rng, extent: Pair, correlation: Pair, slope: float, detail: float = 4.0
) -> Real:
    """Draw a periodic Gaussian field of unit variance whose power is ∝ (1 + |ql|²)^(−slope/2).

    l is `correlation`, µm along x and y (von Kármán's spectrum, Progress in the statistical theory
    of turbulence, 1948). The grid has `detail` nodes per correlation length and does not depend on
    the pixels of the patch: a seed gives one surface at every resolution. The mean is 0.

    Returns
    -------
    array (my, mx)
        Values on a grid that divides `extent` (Lx, Ly) evenly.
    """
    (width, height), (lx, ly) = extent, correlation
    mx, my = (max(8, 2 * math.ceil(detail * e / c / 2)) for e, c in ((width, lx), (height, ly)))
    qx = 2 * np.pi * np.fft.rfftfreq(mx, width / mx)
    qy = 2 * np.pi * np.fft.fftfreq(my, height / my)[:, None]
    amplitude = (1 + (qx * lx) ** 2 + (qy * ly) ** 2) ** (-slope / 4)
    amplitude[0, 0] = 0
    waves = np.fft.rfft2(rng.standard_normal((my, mx))) * amplitude
    # filtered white noise has the variance Σ (impulse response)²
    response = np.fft.irfft2(amplitude, (my, mx))
    return np.fft.irfft2(waves, (my, mx)) / math.sqrt(float((response**2).sum()))


def sample_field(field: Real, extent: Pair, x: Real, y: Real) -> Real:
    """Interpolate a periodic `field` (my, mx) over `extent` at points in µm, by cubic splines."""
    my, mx = field.shape
    indices = (y * (my / extent[1]), x * (mx / extent[0]))
    return np.asarray(scipy.ndimage.map_coordinates(field, indices, order=3, mode="grid-wrap"))


def grain(rng: Rng, extent: Pair, shape: Shape, size: Pair) -> Real:
    """Draw white noise blurred to grains of `size` (σ along x, along y, µm), of unit variance.

    Noise is drawn per pixel, so a seed gives another texture at another resolution. The statistics
    are the same while the pixels are finer than the grains.
    """
    ny, nx = shape
    sigma = (size[1] * ny / extent[1], size[0] * nx / extent[0])
    noise = scipy.ndimage.gaussian_filter(
        rng.standard_normal(shape), sigma, mode="wrap", truncate=3
    )
    variance = math.prod(_filtered_variance(s, n) for s, n in zip(sigma, shape, strict=True))
    return noise / math.sqrt(variance)


def _filtered_variance(sigma: float, n: int) -> float:
    """Return the variance of unit white noise after a Gaussian filter along n pixels."""
    impulse = np.zeros(n)
    impulse[0] = 1
    if sigma > 0:
        impulse = scipy.ndimage.gaussian_filter(impulse, sigma, mode="wrap", truncate=3)
    return float((impulse**2).sum())


def rounded(heights: Real) -> Real:
    """Round heights in µm towards 0 to about a picometre: equal heights on every processor.

    Processors differ in the last bits of sines. A height that lies within them of a rounding step
    still differs, about one in ten billion.
    """
    return np.trunc(heights * 2.0**20) * 2.0**-20
