"""Directions to test with, and integrals done the slow and obvious way (NumPy only)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.tradeoff.sample import as_single, lit_pairs, uniform_directions

__all__ = ["as_single", "lit_pairs", "polar", "riemann_power", "rough_patch", "uniform_directions"]

Array = NDArray[np.float64]


def polar(theta: float, phi: float = 0.0) -> Array:
    """Unit vector (3,) at these angles in degrees from the normal and from x."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def riemann_power(
    field: HeightField, alpha: float, beta: float, kappa: float, sigma: float, coherence: str
) -> float:
    """⟨|P|²⟩ in µm⁴ as a sum over the pixels of the tiled plane, without any transform.

    P = Σ g(x − x₀) exp(iκh(x)) exp(i(αx + βy)) dx dy. For `ensemble` the window sits on every pixel
    in turn, which averages exactly: |P|² has no frequencies beyond those of the pixels in x₀.
    """
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    lx, ly = field.extent
    reach = 8.7 * sigma  # g is 4e-17 there
    if coherence == "patch":
        centres = [(0.5 * lx, 0.5 * ly)]
    else:
        centres = [(ix * dx, iy * dy) for iy in range(ny) for ix in range(nx)]
    total = 0.0
    for x0, y0 in centres:
        ix = np.arange(np.ceil((x0 - reach) / dx), np.floor((x0 + reach) / dx) + 1).astype(int)
        iy = np.arange(np.ceil((y0 - reach) / dy), np.floor((y0 + reach) / dy) + 1).astype(int)
        heights = field.heights[np.ix_(iy % ny, ix % nx)]
        x, y = ix * dx, (iy * dy)[:, None]
        window = np.exp(-((x - x0) ** 2 + (y - y0) ** 2) / (2 * sigma**2))
        integrand = window * np.exp(1j * (kappa * heights + alpha * x + beta * y))
        total += np.abs(integrand.sum() * dx * dy) ** 2
    return total / len(centres)


def rough_patch(
    shape: tuple[int, int],
    pixel_size: tuple[float, float],
    depth: float,
    correlation: float = 0.4,
    seed: int = 1,
) -> HeightField:
    """A random, tiling, asymmetric surface: Gaussian correlation (µm) in y, twice that in x.

    Parameters
    ----------
    shape : (ny, nx).
    pixel_size : (dx, dy), µm.
    depth : peak to valley, µm.
    """
    noise = np.fft.fft2(np.random.default_rng(seed).normal(size=shape))
    qy = 2 * np.pi * np.fft.fftfreq(shape[0], pixel_size[1])[:, None]
    qx = 2 * np.pi * np.fft.fftfreq(shape[1], pixel_size[0])
    smooth = np.exp(-0.25 * correlation**2 * (4 * qx**2 + qy**2))
    heights = np.fft.ifft2(noise * smooth).real
    heights = heights + 0.5 * heights.std() * (heights / heights.std()) ** 2  # no up-down symmetry
    heights = (heights - heights.min()) * (depth / np.ptp(heights))
    return HeightField(heights, pixel_size, name="rough patch")
