"""The integral over the heights, for every direction pair: ⟨|P|²⟩, which knows no material.

The patch tiles the plane. Its phase screen, known at the pixels, is the band-limited function

    exp(iκh(r)) = Σ_j a_j(κ) exp(−i q_j·r),   a_j(κ) = mean over pixels of exp(iκh) exp(i q_j·r),

with |q_j| up to the Nyquist frequency π/dx: a sampled surface says nothing beyond. Under a window
g(r − x₀) = exp(−|r − x₀|²/2σ²) the integral over the plane is then a sum of the window's spectrum
ĝ(q) = 2πσ² exp(−σ²q²/2) around every order,

    P(q) = Σ_j a_j ĝ(q − q_j) exp(−i q_j·x₀)   (up to a phase common to all orders),

and its power averaged over every window position x₀ keeps the diagonal alone:

    ⟨|P|²⟩ = 4π²σ⁴ Σ_j |a_j|² exp(−σ²|q − q_j|²).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..heights.field import HeightField
from ..optics.geometry import diffraction_coordinates, wavenumber

# exp(−8.6²/2) = 9e-17: further orders are below the last bit of the sum
_REACH = 8.6


def window_power(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    sigma: float,
    coherence: str,
    places: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """⟨|P|²⟩ in µm⁴, shape (n,), one explicit integral per direction pair.

    places : (n, 2), centres of the windows in µm, instead of the patch's.
    """
    k = wavenumber(wavelength)
    u, v, w = diffraction_coordinates(wi, wo)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    power = np.zeros(len(k))
    for n in np.flatnonzero(above):
        phase_screen = np.exp(1j * (k[n] * w[n]) * field.heights)
        place = None if places is None else (places[n, 0], places[n, 1])
        power[n] = screen_power(
            phase_screen, field.pixel_size, k[n] * u[n], k[n] * v[n], sigma, coherence, place
        )
    return power


def screen_power(
    phase_screen: NDArray[np.complex128],
    pixel_size: tuple[float, float],
    alpha: float,
    beta: float,
    sigma: float,
    coherence: str,
    place: tuple[float, float] | None = None,
) -> float:
    """⟨|P|²⟩ in µm⁴ of one phase screen (ny, nx) at the spatial frequency (α, β) in rad/µm.

    place : centre of the window in µm, instead of the patch's.
    """
    ny, nx = phase_screen.shape
    qx, waves_x = plane_waves(nx, pixel_size[0], alpha, sigma)
    qy, waves_y = plane_waves(ny, pixel_size[1], beta, sigma)
    amplitude = waves_y @ phase_screen @ waves_x.T / (nx * ny)
    window_x = np.exp(-0.5 * (sigma * (alpha - qx)) ** 2)
    window_y = np.exp(-0.5 * (sigma * (beta - qy)) ** 2)
    if coherence == "ensemble":
        total = window_y**2 @ np.abs(amplitude) ** 2 @ window_x**2
    else:
        x, y = place or (0.5 * nx * pixel_size[0], 0.5 * ny * pixel_size[1])
        centre_x, centre_y = np.exp(-1j * qx * x), np.exp(-1j * qy * y)
        total = np.abs((window_y * centre_y) @ amplitude @ (window_x * centre_x)) ** 2
    return float(4 * np.pi**2 * sigma**4 * total)


def plane_waves(
    n: int, pixel: float, frequency: float, sigma: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies q_j within the window's reach of `frequency`, and exp(i q_j x) at the pixels."""
    spacing = 2 * np.pi / (n * pixel)
    first = np.ceil((frequency - _REACH / sigma) / spacing)
    last = np.floor((frequency + _REACH / sigma) / spacing)
    # The frequencies of a DFT of n points: an even n has −n/2 but not +n/2
    j = np.arange(max(first, -(n // 2)), min(last, (n - 1) // 2) + 1)
    turns = np.outer(j, np.arange(n)) % n  # exact integers keep the phase exact
    return j * spacing, np.exp(2j * np.pi / n * turns)
