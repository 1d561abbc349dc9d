"""Periodic random fields: the irregular part of a natural surface, and their patches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from ...arrays import Real
from ...errors import DiffractionError, quoted
from ..field import HeightField
from ..lengths import count_between, number_between

Rng = np.random.Generator
#: Lengths along x and y, µm.
Pair = tuple[float, float]
#: Numbers of pixels (ny, nx).
Shape = tuple[int, int]
#: One value for both axes, or a pair (along x, along y).
Lengths = float | Sequence[float]
Counts = int | Sequence[int]


def grid(
    name: str, extent: Lengths, pixels: Counts, seed: int, ends: Pair, most: int = 8192
) -> tuple[Pair, Shape, np.random.SeedSequence]:
    """Check the size, the number of pixels and the seed of a patch, as users write them.

    name : of the generator, in errors.
    ends : shortest and longest side, µm.
    most : pixels along a side.

    Raises a DiffractionError if one is out of its range.

    Returns
    -------
    size, shape, seeds
        (Lx, Ly) in µm, (ny, nx), and the source of random streams.
    """
    sides = [
        number_between(v, f"{name}: extent", *ends, " µm") for v in _pair(extent, f"{name}: extent")
    ]
    counts = [
        count_between(v, f"{name}: pixels", 8, most) for v in _pair(pixels, f"{name}: pixels")
    ]
    seeds = np.random.SeedSequence(count_between(seed, f"{name}: seed", 0, 2**63 - 1))
    return (sides[0], sides[1]), (counts[1], counts[0]), seeds


def _pair(value: Any, where: str) -> Sequence[Any]:
    """Return both elements of a pair, or a single value twice; the values are not checked."""
    pair = value if isinstance(value, list | tuple) else (value, value)
    if len(pair) != 2:
        raise DiffractionError(
            f"{where}: expected one number or a pair (along x, along y), got {quoted(value)}"
        )
    return pair


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


def patch(name: str, heights: Real, size: Pair, *, periodic: bool = False) -> HeightField:
    """Return a patch; heights in µm are rounded towards 0 to about a picometre.

    Heights are then equal on every processor.

    Processors differ in the last bits of sines. A height that lies within them of a rounding step
    still differs, about one in ten billion.
    """
    (ny, nx), even = heights.shape, np.trunc(heights * 2.0**20) * 2.0**-20
    return HeightField(even, (size[0] / nx, size[1] / ny), name=name, periodic=periodic)
