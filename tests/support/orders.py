"""Tables of orders that need no solver."""

from __future__ import annotations

import numpy as np
from scipy.special import jv

from mitsuba_diffraction.tables.orders import Band, OrderTable, cells
from mitsuba_diffraction.tables.orders.table import Counts


def thin_grating(
    period: float = 1.6,
    depth: float = 0.12,
    reflectance: float = 0.75,
    wavelengths: tuple[float, float] = (380.0, 780.0),
    counts: Counts = Counts(6, 5, 3),  # noqa: B008 - immutable
    superstrate: float = 1.0,
) -> OrderTable:
    """A sinusoidal phase grating: J_m² of its phase, which is reciprocal, times a reflectance.

    The phase of order m is π depth (cosθ_j + cosθ_q)/λ, the mean of both directions': sums over
    orders are about 1, below the reflectance's headroom.
    """
    optical = superstrate * period

    def kind(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        tau, rho, w = (cells.nodes(n) for n in counts)
        tau, rho, w = (part[..., None] for part in np.meshgrid(tau, rho, w, indexing="ij"))
        big_k = k + cells.sine_squared(rho)
        lam = cells.wavelength_of(big_k, w, wavelengths, optical)
        at = cells.from_cell(k, kind, channels, tau, rho, lam, optical)
        cosine = np.sqrt(np.maximum(1.0 - at.x**2 - at.y**2, 0.0))
        phase = np.pi * depth * superstrate * 1e3 / lam[..., None]
        phase = phase * (cosine[..., :, None] + cosine[..., None, :])
        order = channels[:, None] - channels
        # light grows from 0 at the horizon, as Maxwell's does
        grazing = cosine[..., :, None] * cosine[..., None, :]
        power = reflectance * jv(order, phase) ** 2 * (1.0 - np.exp(-20.0 * grazing))
        values = np.where(order == 0, reflectance * jv(0, phase) ** 2, power)
        return np.repeat(values[..., None], 2, axis=-1).astype(np.float32)

    bands = tuple(
        Band(k, kind(k, cells.A), kind(k, cells.B) if k else None)
        for k in range(cells.largest_band(wavelengths, optical) + 1)
    )
    return OrderTable(period, wavelengths, bands, superstrate, {"profile": "thin sinusoid"})
