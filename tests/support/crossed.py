"""A crossed grating in closed form: a mirror with shallow sine waves along x and along y."""

from __future__ import annotations

import functools
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import jv

from mitsuba_diffraction import OrderTable, read_orders
from mitsuba_diffraction.optics.orders import crossed_square, order_factor
from mitsuba_diffraction.orders.listing import Listing

PERIODS, RANGE = (0.8, 1.1), (450.0, 650.0)
#: Reflectance; and amplitudes of the sine waves along x and y, µm.
REFLECTANCE, DEPTHS = 0.8, (0.03, 0.015)
#: Of the clear material.
INDEX = 1.5


class Efficiencies(NamedTuple):
    """Efficiencies (a, b, c, m, 2) of light (a,), (b,), (c,) and orders (m, 2); NaN: none."""

    wavelengths: np.ndarray
    theta: np.ndarray
    phi: np.ndarray
    orders: np.ndarray
    values: np.ndarray


def efficiency(x, y, wavelength, m, n):
    """Scalar theory (Goodman 2005, section 4.4.4), phases from both cosines: it is reciprocal."""
    out = x + m * wavelength / (1e3 * PERIODS[0]), y + n * wavelength / (1e3 * PERIODS[1])
    cosines = [np.sqrt(np.maximum(1.0 - a * a - b * b, 0.0)) for a, b in ((x, y), out)]
    phase = 2e3 * np.pi / wavelength * sum(cosines)
    powers = jv(m, DEPTHS[0] * phase) ** 2 * jv(n, DEPTHS[1] * phase) ** 2
    shifts = (1e-3 * k * wavelength / d for k, d in zip((m, n), PERIODS, strict=True))
    return np.where(crossed_square(x, y, *shifts) > 0.0, REFLECTANCE * powers, np.nan)


def clear_efficiency(x, y, wavelength, m, n):
    """Efficiencies in constant ratios to those of shallow heights of a clear material."""
    shifts = (1e-3 * k * wavelength / d for k, d in zip((m, n), PERIODS, strict=True))
    came, left = crossed_square(x, y, 0.0, 0.0), crossed_square(x, y, *shifts)
    zeroth, ratio = (m == 0) & (n == 0), 0.1 * 0.5 ** (np.abs(m) + np.abs(n))
    light = np.where(zeroth, 1.0, ratio) * order_factor(came + 0.0 * left, left, zeroth, INDEX)
    return np.where(left > 0.0, light, np.nan)


def listed(theta, phi, wavelengths, of_order=efficiency):
    """Efficiencies on a grid, as a file has them."""
    m_x, m_y = (int(2e3 * period / wavelengths[0]) for period in PERIODS)
    pairs = np.mgrid[-m_x : m_x + 1, -m_y : m_y + 1].reshape(2, -1)
    lam, polar, azimuth, m = np.meshgrid(
        wavelengths, theta, phi, np.arange(pairs.shape[1]), indexing="ij"
    )
    sine, turn = np.sin(np.radians(polar)), np.radians(azimuth)
    values = of_order(-sine * np.cos(turn), -sine * np.sin(turn), lam, *pairs[:, m])
    values = np.repeat(values[..., None], 2, axis=-1)
    return Efficiencies(np.asarray(wavelengths), theta, phi, pairs.T, values)


@functools.cache
def table() -> OrderTable:
    """Its table."""
    grid = listed(np.arange(0.0, 86.0, 5.0), np.arange(0.0, 360.0, 15.0), np.arange(450, 651, 20.0))
    return _imported(grid)


@functools.cache
def clear_table() -> OrderTable:
    """Table of a clear material, `clear_efficiency`."""
    grid = listed(
        np.arange(0.0, 89.0, 8.0), np.arange(0.0, 360.0, 20.0), [450.0, 550.0, 650.0],
        clear_efficiency,
    )  # fmt: skip
    made = _imported(grid)
    return replace(made, response=replace(made.response, index=INDEX))


def _imported(grid: Efficiencies) -> OrderTable:
    with tempfile.TemporaryDirectory() as folder:
        save_csv(grid, Path(folder, "sine_waves.csv"))
        return read_orders(Path(folder, "sine_waves.csv"), PERIODS)


def save_csv(grid: Efficiencies, path) -> None:
    """Write a grid as the long CSV that `read_orders` reads."""
    a, b, c, k = np.argwhere(~np.isnan(grid.values[..., 0])).T
    light = grid.wavelengths[a], grid.theta[b], grid.phi[c]
    names = "wavelength_nm", "theta_deg", "phi_deg", "order_x", "order_y", "R_s", "R_p"
    rows = np.column_stack([*light, grid.orders[k], grid.values[a, b, c, k]])
    Listing(names, rows).save(path)
