"""⟨|P|²⟩ of a phase screen under any window: averaged over positions, or at one of them.

Under a window g(r − x₀) = exp(−|r − x₀|²/2σ²) the integral over the tiled plane is a sum over the
orders of `model`, each under the window's spectrum ĝ(q) = 2πσ² exp(−σ²q²/2):

    P(q) = Σ_j a_j ĝ(q − q_j) exp(−i q_j·x₀)   (up to a phase common to all orders).

The mean of |P|² over all positions x₀ keeps the diagonal alone, eq. (3) of `model`, where order 0
has the light's own window. One window has one width, σ, for all orders. A sampled
surface has no orders beyond its Nyquist frequency π/dx.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Complex, Real
from ..heights import HeightField
from .model import Light, ensemble_power, window_sums
from .screens import Orders, Sigmas, Sums, orders_near


def window_power(
    field: HeightField,
    wi: Real,
    wo: Real,
    wavelength: Real,
    sigmas: Sigmas,
    coherence: str,
    positions: Real | None = None,
) -> Real:
    """⟨|P|²⟩ of all orders in µm⁴, shape (n,); arguments as for `window_powers`."""
    return all_orders(window_powers(field, wi, wo, wavelength, sigmas, coherence, positions))


def window_powers(
    field: HeightField,
    wi: Real,
    wo: Real,
    wavelength: Real,
    sigmas: Sigmas,
    coherence: str,
    positions: Real | None = None,
) -> Real:
    """⟨|P|²⟩ of all orders but 0, and of order 0, in µm⁴, and how they interfere, (3, n).

    The last is the cosine of the phase between both under one window; 0 in an ensemble.

    positions : (n, 2), centres of the windows in µm, instead of the patch's centre.
    """
    powers = np.zeros((3, len(wavelength)))
    for n in np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0)):
        pair = Light(wi[n : n + 1], wo[n : n + 1], wavelength[n : n + 1])
        centre = 0.5 * np.array(field.extent) if positions is None else positions[n]
        powers[:, n] = ensemble_power(field, pair, sigmas, sums_of(coherence, centre))[:, 0]
    return powers


def sums_of(coherence: str, centre: ArrayLike) -> Sums:
    """Return the sums over orders of a coherence; centre : of one window, µm."""
    if coherence == "ensemble":
        return window_sums
    return partial(_one_window, np.asarray(centre, np.float64))


def _one_window(
    centre: Real, orders: Orders, q: tuple[float, float], sigmas: Sigmas
) -> tuple[float, float, float]:
    """`model.Sums` under a window at its centre, µm."""
    sigma, unit = sigmas.orders, 4 * np.pi**2 * sigmas.orders**4
    window_x, window_y = (
        np.exp(-0.5 * (sigma * (at - each)) ** 2 - 1j * each * place)
        for at, each, place in zip(q, (orders.qx, orders.qy), centre, strict=True)
    )
    zeroth = orders.zeroth * np.exp(-0.5 * sigma**2 * (q[0] ** 2 + q[1] ** 2))
    rest = window_y @ orders.a @ window_x - zeroth
    cosine = (rest * np.conj(zeroth)).real / max(np.abs(rest) * np.abs(zeroth), 1e-300)
    return float(unit * np.abs(rest) ** 2), float(unit * np.abs(zeroth) ** 2), float(cosine)


def screen_power(
    screen: Complex,
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
    orders = orders_near((alpha, beta), sigmas.orders, screen, pixel_size)
    middle = 0.5 * np.array(screen.shape[::-1]) * pixel_size
    sums = sums_of(coherence, middle if centre is None else centre)
    return float(all_orders(np.array(sums(orders, (alpha, beta), sigmas))))


def all_orders(powers: Real) -> Real:
    """Return the power of all orders together, from `window_powers`."""
    others, zeroth, cosine = powers
    return np.asarray(others + zeroth + 2.0 * cosine * np.sqrt(others * zeroth))
