"""⟨|P|²⟩ with the second order of small slope: each order times its own factor.

Of an order j of a patch r_j = D_j / a_j is exact (`optics.second_order`, whose spectra are
the conjugates of this integral's), and so is c of a pair of directions (`optics.second_order`):

    ⟨|P|²⟩ = 4π²σ⁴ Σ_j |a_j|² |1 + s (c_l r_l,j + c_t r_t,j)|² exp(−σ²|q − q_j|²).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..heights.field import HeightField
from ..optics.geometry import diffraction_coordinates, wavenumber
from ..optics.second_order import factor, slope_coefficients
from ..optics.slope_ratios import Slopes, along
from .integral import plane_waves

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def second_order_power(
    field: HeightField, light: tuple[Real, Real, Real], sigma: float, index: Real, share: Real
) -> Real:
    """⟨|P|²⟩ in µm⁴, (n,), averaged over all positions of the window.

    Parameters
    ----------
    light : wi (n, 3), wo (n, 3), wavelength (n,) in nm.
    index : (n,) of the dielectric over that of the medium above it.
    share : (n,) s, of small slope in the model.
    """
    wi, wo, wavelength = light
    wave, (u, v, w) = wavenumber(wavelength), diffraction_coordinates(wi, wo)
    slopes, power = Slopes.of(field.heights, field.pixel_size), np.zeros(len(wave))
    for n in np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0)):
        coefficients = slope_coefficients(wi[n], wo[n : n + 1], index[n])
        screen = np.exp(1j * wave[n] * w[n] * field.heights)
        q, amplitudes = _spectra(screen, slopes, field, wave[n] * u[n], wave[n] * v[n], sigma)
        squares = np.abs(amplitudes[0]) ** 2
        other = (squares > 0) & np.any(q != 0, axis=-1)  # order 0's power is the first order's
        a, *products = amplitudes[:, other].conj()
        ratios = np.zeros((*q.shape[:2], 2), complex)
        ratios[other] = along(q[other], np.stack(products, axis=-1)) / a[:, None]
        distances = np.sum((q - wave[n] * np.array([u[n], v[n]])) ** 2, axis=-1)
        factors = factor(coefficients, slopes.gate * ratios, share[n])
        power[n] = np.sum(np.exp(-(sigma**2) * distances) * squares * factors)
    return 4 * np.pi**2 * sigma**4 * power


def _spectra(
    screen: Complex, slopes: Slopes, field: HeightField, alpha: float, beta: float, sigma: float
) -> tuple[Real, Complex]:
    """Orders about (α, β): frequencies (ny, nx, 2), and a, D (4, ny, nx)."""
    ny, nx = field.shape
    qx, waves_x = plane_waves(nx, field.pixel_size[0], alpha, sigma)
    qy, waves_y = plane_waves(ny, field.pixel_size[1], beta, sigma)
    functions = screen * np.stack([np.ones(field.shape), *slopes.products])
    return np.stack(np.meshgrid(qx, qy), axis=-1), waves_y @ functions @ waves_x.T / (nx * ny)
