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
from .model import Sigmas, orders_near, window_sums


def window_power(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    sigmas: Sigmas,
    coherence: str,
    positions: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """⟨|P|²⟩ of all orders in µm⁴, shape (n,); arguments as for `window_powers`."""
    others, zeroth, cosine = window_powers(field, wi, wo, wavelength, sigmas, coherence, positions)
    return np.asarray(others + zeroth + 2.0 * cosine * np.sqrt(others * zeroth))


def window_powers(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    sigmas: Sigmas,
    coherence: str,
    positions: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """⟨|P|²⟩ of all orders but 0, and of order 0, in µm⁴, and how they interfere, (3, n).

    The last is the cosine of the phase between both under one window; 0 in an ensemble.

    positions : (n, 2), centres of the windows in µm, instead of the patch's centre.
    """
    k = wavenumber(wavelength)
    u, v, w = diffraction_coordinates(wi, wo)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    powers = np.zeros((3, len(k)))
    for n in np.flatnonzero(above):
        centre = None if positions is None else (positions[n, 0], positions[n, 1])
        q = (k[n] * u[n], k[n] * v[n])
        powers[:, n] = field_powers(field, k[n] * w[n], q, sigmas, coherence, centre)
    return powers


def field_powers(
    field: HeightField,
    kappa: float,
    q: tuple[float, float],
    sigmas: Sigmas,
    coherence: str,
    centre: tuple[float, float] | None = None,
) -> NDArray[np.float64]:
    """`window_powers` (3,) of a patch, or their means over the windows of a scan.

    kappa, q : phase per height, and spatial frequency along x and y, rad/µm.
    sigmas, coherence, centre : see `screen_power`.
    """
    tapers, parts = scan.tapers(field, sigmas.windows), scan.parts(field, sigmas.windows)
    screens = (np.exp(1j * kappa * part) for part in parts)
    powers = [
        screen_powers(screen, field.pixel_size, *q, sigmas, coherence, centre, tapers)
        for screen in screens
    ]
    others, zeroth, cosine = np.mean(powers, axis=0)
    return np.array([max(others, 0.0), zeroth, cosine])  # `model.ensemble_power` says why


def screen_power(
    screen: NDArray[np.complex128],
    pixel_size: tuple[float, float],
    alpha: float,
    beta: float,
    sigmas: Sigmas,
    coherence: str,
    centre: tuple[float, float] | None = None,
) -> float:
    """⟨|P|²⟩ in µm⁴ of one phase screen (ny, nx) at the spatial frequency (α, β) in rad/µm.

    sigmas : of the windows; for `patch` the orders' window.
    centre : of the window in µm, instead of the patch's centre.
    """
    others, zeroth, cosine = screen_powers(
        screen, pixel_size, alpha, beta, sigmas, coherence, centre
    )
    return float(others + zeroth + 2.0 * cosine * np.sqrt(others * zeroth))


def screen_powers(
    screen: NDArray[np.complex128],
    pixel_size: tuple[float, float],
    alpha: float,
    beta: float,
    sigmas: Sigmas,
    coherence: str,
    centre: tuple[float, float] | None = None,
    tapers: scan.Tapers | None = None,
) -> tuple[float, float, float]:
    """`window_powers` of one screen; arguments as for `screen_power`.

    tapers : along y and x, of a window of a scan.
    """
    sigma = sigmas.orders
    orders = orders_near((alpha, beta), sigma, screen, pixel_size, tapers)
    if coherence == "ensemble":
        return *window_sums(orders, (alpha, beta), sigmas), 0.0
    ny, nx = screen.shape
    x, y = centre or (0.5 * nx * pixel_size[0], 0.5 * ny * pixel_size[1])
    window_x = np.exp(-0.5 * (sigma * (alpha - orders.qx)) ** 2) * np.exp(-1j * orders.qx * x)
    window_y = np.exp(-0.5 * (sigma * (beta - orders.qy)) ** 2) * np.exp(-1j * orders.qy * y)
    zeroth = screen.mean() * np.exp(-0.5 * sigma**2 * (alpha**2 + beta**2))
    rest = window_y @ orders.a @ window_x - zeroth
    cosine = (rest * np.conj(zeroth)).real / max(np.abs(rest) * np.abs(zeroth), 1e-300)
    unit = 4 * np.pi**2 * sigma**4
    return float(unit * np.abs(rest) ** 2), float(unit * np.abs(zeroth) ** 2), float(cosine)
