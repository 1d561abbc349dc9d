"""Directions to test with, and integrals done the slow and obvious way (NumPy only)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import HeightField

Array = NDArray[np.float64]


def polar(theta: float, phi: float = 0.0) -> Array:
    """Unit vector (3,) at these angles in degrees from the normal and from x."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def uniform_directions(n: int, rng: np.random.Generator, lowest: float = 0.1) -> Array:
    """Unit vectors (n, 3), uniform over the hemisphere above cosθ = lowest, exact in float32."""
    z = rng.uniform(lowest, 1.0, n)
    phi = rng.uniform(0.0, 2 * np.pi, n)
    r = np.sqrt(1.0 - z * z)
    return as_single(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1))


def as_single(values: Array) -> Array:
    """The values that single precision can hold: then both sides get the same input."""
    return values.astype(np.float32).astype(np.float64)


def lit_pairs(
    field: HeightField, sigma: float, n: int, seed: int
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Direction pairs and wavelengths where the patch sends light, and some where it may not.

    A quarter lies within the lobe of order 0, a quarter is uniform over the hemisphere, and half
    lies in the lobes of orders drawn by their power: a grating is dark nearly everywhere else.

    Returns
    -------
    wi, wo (n, 3), wavelength (n,) in nm, all exact in float32, and (n,) whether the pair lies
    within 3/σ of order 0.
    """
    rng = np.random.default_rng(seed)
    lx, ly = field.extent
    ny, nx = field.shape
    screen = np.exp(1j * 4 * np.pi / 0.55 * field.heights)  # 550 nm, straight down and up again
    power = np.abs(np.fft.ifft2(screen)) ** 2
    power[0, 0] = 0.0
    drawn = rng.choice(power.size, 50 * n, p=power.ravel() / power.sum())
    orders = np.stack(
        [
            2 * np.pi / lx * (np.fft.fftfreq(nx) * nx)[drawn % nx],
            2 * np.pi / ly * (np.fft.fftfreq(ny) * ny)[drawn // nx],
        ],
        axis=1,
    )
    jitter = rng.normal(0.0, 1.0 / (np.sqrt(2.0) * sigma), (50 * n, 2))
    incident = uniform_directions(50 * n, rng)
    lam = as_single(rng.uniform(380.0, 780.0, 50 * n))
    k = 2e3 * np.pi / lam
    uniform = uniform_directions(50 * n, rng)
    kinds = np.arange(50 * n) % 4
    q = np.where((kinds == 0)[:, None], 0.0, orders) + jitter
    tangential = q / k[:, None] - incident[:, :2]
    z2 = 1.0 - np.sum(tangential**2, axis=1)
    aimed = np.concatenate([tangential, np.sqrt(np.maximum(z2, 0.0))[:, None]], axis=1)
    outgoing = as_single(np.where((kinds == 1)[:, None], uniform, aimed))
    # Orders that do not propagate, or only along the surface, give way to others of their kind
    good = (kinds == 1) | (z2 > 0.01)
    chosen = np.concatenate([np.flatnonzero(good & (kinds == c))[: n // 4] for c in range(4)])
    wi, wo, lam = incident[chosen], outgoing[chosen], lam[chosen]
    near = np.hypot(*(wi + wo)[:, :2].T) * 2e3 * np.pi / lam * sigma <= 3.0
    return wi, wo, lam, near


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
