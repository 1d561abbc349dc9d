"""Orders of ideal gratings in closed form, and how closely the package reproduces them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import jv

from mitsuba_diffraction import DiffractionTable, HeightField, reference
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, kirchhoff_factor, wavenumber

from .cases import WAVELENGTHS, Grating, in_plane, order_sines
from .model import LOBE_SIGMA

#: Angles of incidence, and the largest angle of an order, degrees.
ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
#: Table tolerance: relative to the sum over orders, which is 1.
TABLE_TOLERANCE = 3e-5


def order_power(grating: Grating, order: ArrayLike, kappa: ArrayLike) -> Real:
    """|a_m|² of the ideal grating (Goodman, Introduction to Fourier Optics, section 4.4).

    With φ = κ·depth: J_m²(φ/2) for a sinusoid; for a lamellar grating, half high, cos²(φ/2) at
    m = 0, 4/(πm)²·sin²(φ/2) at odd m and nothing at even m; sinc²(m + φ/2π) for a blazed one that
    ascends towards +x.

    Parameters
    ----------
    order : m, whole numbers, broadcast with `kappa`.
    kappa : k·w, rad/µm.
    """
    m, phase = np.asarray(order, np.float64), np.asarray(kappa, np.float64) * grating.depth
    if grating.profile == "sinusoidal":
        return np.asarray(jv(m, phase / 2) ** 2)
    if grating.profile == "blazed":
        return np.asarray(np.sinc(m + phase / (2 * np.pi)) ** 2)
    odd = np.where(m % 2 == 1, 4 / (np.pi * np.where(m == 0, 1, m)) ** 2, 0.0)
    return np.where(m == 0, np.cos(phase / 2) ** 2, odd * np.sin(phase / 2) ** 2)


@dataclass(frozen=True)
class Deviations:
    """Largest |approximate − closed form| of |a_m|² by the integral and by a table; how many."""

    integral: float
    table: float
    orders: int


def deviations(grating: Grating, pixels: int = 512) -> Deviations:
    """Compare every order at all `ANGLES` and `WAVELENGTHS`.

    Parameters
    ----------
    grating : sampled with `pixels` per period.
    """
    strip = grating.heights(pixels)
    # a window much wider than the patch is refused: eight rows in place of two
    field = HeightField(np.tile(strip.heights, (4, 1)), strip.pixel_size)
    # under a window as wide as the period other orders weigh exp(−4π²), 7e-18
    table = DiffractionTable.build(
        field, coherence_width=4 * grating.period, tolerance=TABLE_TOLERANCE, height_scale_max=1.0
    )
    worst_integral, worst_table, count = 0.0, 0.0, 0
    for wavelength in WAVELENGTHS:
        k = float(wavenumber(wavelength))
        for theta in ANGLES:
            orders, sines = order_sines(grating.period, wavelength, theta)
            keep = np.abs(sines) <= np.sin(np.radians(ANGLES[-1] + 1e-9))
            orders, sines = orders[keep], sines[keep]
            wi, wo = in_plane(np.sin(np.radians(theta))), in_plane(sines)
            kappa = k * (wi[2] + wo[:, 2])
            exact = order_power(grating, orders, kappa)
            # the BRDF at a lobe's centre is factor · 4π²σ⁴ |a_m|²
            unit = 4 * np.pi**2 * LOBE_SIGMA**4
            scale = kirchhoff_factor(wi, wo, wavelength, LOBE_SIGMA) * unit
            width = WIDTHS_PER_SIGMA * LOBE_SIGMA
            peaks = reference.brdf(strip, wi, wo, wavelength, coherence_width=width) / scale
            looked_up = table.window_sum(2 * np.pi * orders / grating.period, 0.0, kappa)
            worst_integral = max(worst_integral, float(np.max(np.abs(peaks - exact))))
            worst_table = max(worst_table, float(np.max(np.abs(looked_up - exact))))
            count += len(orders)
    return Deviations(worst_integral, worst_table, count)
