"""⟨|P|²⟩ of a phase screen under any window: averaged over positions, or at one of them.

Under a window g(r − x₀) = exp(−|r − x₀|²/2σ²) the integral over the tiled plane is a sum over the
orders of `model`, each under the window's spectrum ĝ(q) = 2πσ² exp(−σ²q²/2):

    P(q) = Σ_j a_j ĝ(q − q_j) exp(−i q_j·x₀)   (up to a phase common to all orders).

The mean of |P|² over all positions x₀ keeps the diagonal alone, eq. (3) of `model`, where order 0
has the light's own window. One window has one width, σ, for all orders. A sampled
surface has no orders beyond its Nyquist frequency π/dx.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..heights.field import HeightField
from ..optics.geometry import diffraction_coordinates, wavenumber
from . import scan
from .model import Sigmas, orders_near, window_sum


def window_power(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    sigmas: Sigmas,
    coherence: str,
    positions: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """⟨|P|²⟩ in µm⁴, shape (n,), one explicit integral per direction pair.

    positions : (n, 2), centres of the windows in µm, instead of the patch's centre.
    """
    k = wavenumber(wavelength)
    u, v, w = diffraction_coordinates(wi, wo)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    power = np.zeros(len(k))
    for n in np.flatnonzero(above):
        centre = None if positions is None else (positions[n, 0], positions[n, 1])
        q = (k[n] * u[n], k[n] * v[n])
        power[n], _ = field_power(field, k[n] * w[n], q, sigmas, coherence, centre)
    return power


def field_power(
    field: HeightField,
    kappa: float,
    q: tuple[float, float],
    sigmas: Sigmas,
    coherence: str,
    centre: tuple[float, float] | None = None,
) -> tuple[float, float]:
    """Return ⟨|P|²⟩ in µm⁴ and |a_0|² of a patch, or their means over the windows of a scan.

    kappa, q : phase per height, and spatial frequency along x and y, rad/µm.
    sigmas, coherence, centre : see `screen_power`.
    """
    tapers, powers, mirror = scan.tapers(field, sigmas.windows), [], []
    for part in scan.parts(field, sigmas.windows):
        screen = np.exp(1j * kappa * part)
        mean = screen.mean() if tapers is None else scan.faded(screen, tapers)[1]
        powers.append(screen_power(screen, field.pixel_size, *q, sigmas, coherence, centre, tapers))
        mirror.append(abs(mean) ** 2)
    return float(np.mean(powers)), float(np.mean(mirror))


def screen_power(
    screen: NDArray[np.complex128],
    pixel_size: tuple[float, float],
    alpha: float,
    beta: float,
    sigmas: Sigmas,
    coherence: str,
    centre: tuple[float, float] | None = None,
    tapers: scan.Tapers | None = None,
) -> float:
    """⟨|P|²⟩ in µm⁴ of one phase screen (ny, nx) at the spatial frequency (α, β) in rad/µm.

    sigmas : of the windows; for `patch` the orders' window.
    centre : of the window in µm, instead of the patch's centre.
    tapers : of a window of a scan, of coherence `ensemble`.
    """
    sigma = sigmas.orders
    orders = orders_near((alpha, beta), sigma, screen, pixel_size, tapers)
    if coherence == "ensemble":
        return window_sum(orders, (alpha, beta), sigmas)
    ny, nx = screen.shape
    x, y = centre or (0.5 * nx * pixel_size[0], 0.5 * ny * pixel_size[1])
    window_x = np.exp(-0.5 * (sigma * (alpha - orders.qx)) ** 2) * np.exp(-1j * orders.qx * x)
    window_y = np.exp(-0.5 * (sigma * (beta - orders.qy)) ** 2) * np.exp(-1j * orders.qy * y)
    total = np.abs(window_y @ orders.a @ window_x) ** 2
    return float(4 * np.pi**2 * sigma**4 * total)
