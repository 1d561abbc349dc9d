"""Directions to test with, and integrals done the slow and obvious way (NumPy only)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_diffraction import HeightField

Array = NDArray[np.float64]


def polar(theta: ArrayLike, phi: ArrayLike = 0.0) -> Array:
    """Unit vectors (…, 3) at these angles in degrees from the normal and from x."""
    theta, phi = np.broadcast_arrays(np.radians(theta), np.radians(phi))
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def turned(directions: Array, degrees: float) -> Array:
    """Directions (n, 3) turned about the normal."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return directions @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def as_single(values: Array) -> Array:
    """The values that single precision can hold, so that both sides get the same input."""
    return np.asarray(values, np.float32).astype(np.float64)


def uniform_directions(n: int, rng: np.random.Generator, lowest: float = 0.1) -> Array:
    """Unit vectors (n, 3), uniform over the hemisphere above cosθ = lowest, exact in float32."""
    z, phi = rng.uniform(lowest, 1.0, n), rng.uniform(0.0, 2 * np.pi, n)
    r = np.sqrt(1.0 - z**2)
    return as_single(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1))


def lit_pairs(
    field: HeightField, sigma: float, n: int, seed: int
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Pairs of directions with wavelengths: near order 0, at random, and in the lobes of orders.

    Of every four pairs one lies in the lobe of order 0, one is uniform over the hemisphere, and two
    lie in lobes of orders drawn by their power at 550 nm.

    Returns
    -------
    wi, wo (n, 3), wavelength (n,) in nm, all exact in float32, and (n,) whether the pair lies
    within 3/σ of order 0.
    """
    rng = np.random.default_rng(seed)
    power = np.abs(np.fft.ifft2(np.exp(1j * 4 * np.pi / 0.55 * field.heights))) ** 2
    power[0, 0] = 0.0
    drawn = rng.choice(power.size, 50 * n, p=power.ravel() / power.sum())
    axes = [
        2 * np.pi * np.fft.fftfreq(m, d)
        for m, d in zip(field.shape[::-1], field.pixel_size, strict=True)
    ]
    orders = iter(zip(axes[0][drawn % axes[0].size], axes[1][drawn // axes[0].size], strict=True))
    pairs = [_lit_pair(rng, kind % 4, orders, sigma) for kind in range(n)]
    wi, wo, lam = (np.array(part) for part in zip(*pairs, strict=True))
    near = np.hypot(*(wi + wo)[:, :2].T) * 2e3 * np.pi / lam * sigma <= 3.0
    return wi, wo, lam, near


def _lit_pair(rng, kind, orders, sigma):
    """One pair: kind 0 near order 0, 1 uniform, others in the lobe of the next order that exits."""
    while True:
        wi, wo = uniform_directions(2, rng)
        lam = float(as_single(rng.uniform(380.0, 780.0)))
        if kind == 1:
            return wi, wo, lam
        q = np.array((0.0, 0.0) if kind == 0 else next(orders))
        q = q + rng.normal(0.0, np.sqrt(0.5) / sigma, 2)
        sines = q * lam / (2e3 * np.pi) - wi[:2]
        if sines @ sines < 0.99:  # neither evanescent nor along the surface
            return wi, as_single(np.append(sines, np.sqrt(1.0 - sines @ sines))), lam


def riemann_power(
    field: HeightField,
    alpha: float,
    beta: float,
    kappa: float,
    sigma: float,
    coherence: str,
    place: tuple[float, float] | None = None,
) -> float:
    """⟨|P|²⟩ in µm⁴ as a sum over the pixels of the tiled plane, without any transform.

    P = Σ g(x − x₀) exp(iκh(x)) exp(i(αx + βy)) dx dy, x₀ = `place` for `surface`. For `ensemble`
    the window sits on every pixel in turn, which averages exactly: |P|² has no frequencies beyond
    those of the pixels in x₀.
    """
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    lx, ly = field.extent
    reach = 8.7 * sigma  # g is 4e-17 there
    if coherence != "ensemble":
        centres = [place or (0.5 * lx, 0.5 * ly)]
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
