"""Power spectra of height fields and of the light that they reflect, for comparisons.

Frequencies are in 1/µm along x and y, as `numpy.fft.fftfreq` gives them; arrays of spectra have
frequency (0, 0) in the middle (`numpy.fft.fftshift`).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates

from .field import HeightField

FloatArray = npt.NDArray[np.float64]


def frequencies(field: HeightField) -> tuple[FloatArray, FloatArray]:
    """Frequencies (nx,) along x and (ny, 1) along y of a spectrum of `field`, 1/µm."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    fx, fy = np.fft.fftfreq(nx, dx), np.fft.fftfreq(ny, dy)
    return np.fft.fftshift(fx), np.fft.fftshift(fy)[:, None]


def height_spectrum(field: HeightField) -> FloatArray:
    """Two-sided power spectral density of the heights, (ny, nx) in µm⁴.

    Its integral over frequencies is the variance. A Hann window, normalised to mean square 1, keeps
    the seams of a measured patch out (Welch, 1967); it is put on periodic ones too, so that they
    compare.
    """
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    window = np.hanning(ny)[:, None] * np.hanning(nx)
    window /= np.sqrt(np.mean(window**2))
    amplitude = np.fft.fft2((field.heights - field.heights.mean()) * window)
    return np.fft.fftshift(np.abs(amplitude) ** 2) * (dx * dy / (nx * ny))


def order_powers(field: HeightField, wavelength: float) -> FloatArray:
    """Share of the light in every order |a_j(κ)|², (ny, nx), at normal incidence and exit.

    a_j(κ) = mean(exp(iκh)·exp(i q_j·x)) with κ = 4π/λ, `wavelength` λ in nm; order j > 0 is turned
    towards +x, as by facets that descend that way, and the shares add up to 1 (Parseval).
    """
    kappa = 4 * np.pi / (wavelength / 1000)
    amplitude = np.fft.ifft2(np.exp(1j * kappa * field.heights))  # +i, divided by the number
    return np.fft.fftshift(np.abs(amplitude) ** 2)


def profile(
    spectrum: FloatArray,
    field: HeightField,
    edges: FloatArray,
    direction: Literal["all", "x", "y"] = "all",
) -> FloatArray:
    """Mean of a spectrum (ny, nx) over rings of frequency between `edges` (n + 1,): shape (n,).

    With a direction, only where frequencies along it are at least twice those across; empty rings
    are NaN.
    """
    fx, fy = frequencies(field)
    ring = np.digitize(np.hypot(fx, fy), edges)
    if direction == "x":
        ring[np.abs(fx) < 2 * np.abs(fy)] = 0
    elif direction == "y":
        ring[np.abs(fy) < 2 * np.abs(fx)] = 0
    n = edges.size + 1
    total = np.bincount(ring.ravel(), spectrum.ravel(), minlength=n)
    count = np.bincount(ring.ravel(), minlength=n).astype(np.float64)
    count[count == 0] = np.nan
    return (total / count)[1:-1]


def far_field(field: HeightField, wavelength: float, size: int = 201) -> FloatArray:
    """Light of one wavelength over the hemisphere, for light along the normal, per unit of (u, v).

    Order j goes to (u, v) = λ·(fx, fy), the direction's sine along x and y. Neighbouring orders are
    smoothed (σ 1.5), about what a coherence window as wide as the patch does; factors of the angle
    alone are left out.

    Returns
    -------
    array (size, size)
        `[iv, iu]`, both from −1 to 1; NaN outside the unit disc.
    """
    width, height = field.extent
    ny, nx = field.shape
    micrometres = wavelength / 1000
    density = gaussian_filter(order_powers(field, wavelength), 1.5, mode="wrap")
    sines = np.linspace(-1, 1, size)
    # order j of fftshift's array lies at index j + n//2
    iu = sines[None, :] * (width / micrometres) + nx // 2
    iv = sines[:, None] * (height / micrometres) + ny // 2
    light = map_coordinates(density, np.broadcast_arrays(iv, iu), order=1, cval=0.0)
    light = np.maximum(light, 0) * (width * height / micrometres**2)
    light[sines[None, :] ** 2 + sines[:, None] ** 2 > 1] = np.nan
    return np.asarray(light)
