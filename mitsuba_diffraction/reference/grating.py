"""The BRDF of a grating from the efficiencies of its orders (NumPy, float64).

    f = Σ_m η_m(ωi, λ) (k²σ²/π) exp(−σ²|q − q_m|²),   q = k (u, v),   q_m = (2πm/d, 0)

Each lobe equals the lobe of order 0 of `reference.model` at normal incidence, moved to q_m: its
integral over cosθo dωo is η_m. Under a flat clear layer of index n with face reflectance R and
transmittance T = 1 − R (Born and Wolf, section 1.5.2; unpolarised powers), the channels of the
grating, a matrix E of efficiencies, become

    η = R δ_m0 + T(ωo) [(1 − E R)⁻¹ E] T(ωi).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from ..errors import DiffractionError
from ..optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from .arguments import directions_of
from .fresnel import reflectance
from .mirror import horizon_correction

#: Efficiency of order m: from x, y, the wavelength (nm) and m, arrays of one shape. x and y are
#: direction cosines within the layer of the mirror direction, −ωi; see `orders.cells`.
Efficiency = Callable[[Real, Real, Real, Real], Real]


def orders_brdf(
    efficiency: Efficiency,
    period: float,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    coherence_width: float = 65.0,
    superstrate: float = 1.0,
) -> Real:
    """BRDF of a grating that repeats along x, for unpolarised light, in 1/sr, shape (n,).

    Raises a DiffractionError for a period or width that is not positive, or arrays whose shapes do
    not fit.

    Parameters
    ----------
    efficiency : of an order, for light within the layer, for example `OrderTable.efficiency`.
    period : µm.
    wi, wo : (n, 3) or (3,), unit vectors that point away from the surface, z along its normal.
    wavelength : (n,) or scalar, vacuum wavelength in nm.
    coherence_width : 4σ of the amplitude window, µm.
    superstrate : index of a flat clear layer over the grating; 1 for none.
    """
    if not (period > 0.0 and coherence_width > 0.0):
        raise DiffractionError(
            f"period={period:g} and coherence_width={coherence_width:g} µm must be positive"
        )
    light = directions_of(wi, wo, wavelength)
    sigma = sigma_of(coherence_width)
    k = wavenumber(light.wavelength)
    u, v, _ = diffraction_coordinates(light.wi, light.wo)
    result = np.zeros(len(k))
    for m in _orders(period, superstrate, light.wavelength):
        distance = (k * u - 2.0 * np.pi * m / period) ** 2 + (k * v) ** 2
        lobe = (k * sigma) ** 2 / np.pi * np.exp(-(sigma**2) * distance)
        near = lobe > 0.0
        if near.any():
            if m == 0:
                lobe *= horizon_correction(light, sigma)
            # η_m as seen from outside of the layer
            x, y = (-light.wi[near, axis] / superstrate for axis in (0, 1))
            lam = light.wavelength[near]
            if superstrate == 1.0:
                powers = efficiency(x, y, lam, np.full(len(x), m))
            else:
                lights = zip(x, y, lam, strict=True)
                powers = np.array(
                    [_coated(efficiency, period, superstrate, *each, m) for each in lights]
                )
            result[near] += lobe[near] * powers
    return np.where((light.wi[:, 2] > 0.0) & (light.wo[:, 2] > 0.0), result, 0.0)


def _coated(
    efficiency: Efficiency, period: float, index: float, x: float, y: float, lam: float, m: int
) -> float:
    """Return η_m of one direction under a layer, with all channels' reflections in it."""
    step = lam / (1e3 * index * period)
    orders = np.array([n for n in _orders(period, index, lam) if (x + n * step) ** 2 + y * y < 1.0])
    if m not in orders:
        return 0.0
    places, count = x + orders * step, len(orders)
    incident = np.repeat(places, count)
    change = orders[None, :] - orders[:, None]
    powers = efficiency(
        incident, np.full(count**2, y), np.full(count**2, lam), change.ravel()
    ).reshape(count, count)
    squared = index**2 * (places**2 + y * y)
    cosine = np.sqrt(np.maximum(1.0 - squared, 0.0))
    back = np.where(squared < 1.0, reflectance(cosine, index), 1.0)
    start, end = (int(np.flatnonzero(orders == n)[0]) for n in (0, m))
    # powers[j, q]: light of channel j leaves through q; the face sends q back into channel q
    summed = np.linalg.solve(np.eye(count) - powers * back[None, :], powers)
    through = (1.0 - back[start]) * summed[start, end] * (1.0 - back[end])
    return float(through + (back[start] if m == 0 else 0.0))


def _orders(period: float, index: float, wavelength: ArrayLike) -> range:
    """Return all orders that may propagate."""
    most = int(2e3 * period * index / np.min(wavelength)) + 1
    return range(-most, most + 1)
