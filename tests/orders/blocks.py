"""A block's face that needs no solver, and the light that its BSDF should have."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.orders import Band, CellResponse, OrderTable, blocks, cells
from mitsuba_diffraction.orders.cells import Counts
from tests.support.directions import Array


def block_grating(
    period: float = 0.45,
    wavelengths: tuple[float, float] = (450.0, 650.0),
    index: float = 1.5,
    counts: Counts = Counts(5, 4, 3),  # noqa: B008 - immutable
    strength: float = 0.006,
    zeroth: float = 0.92,
) -> OrderTable:
    """A block's face: orders ±1 have G_j G_q times a strength, order 0 F times zeroth."""
    optical = index * period

    def kind(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        tau, rho, w = (cells.even_nodes(n)[..., None] for n in counts)
        tau, rho = tau[:, None, None], rho[:, None]
        lam = cells.wavelength_of(k + cells.sine_squared(rho), w, wavelengths, optical)
        light = cells.from_cell(k, kind, channels, tau, rho, lam, optical)
        scale, _ = blocks.factors(index * light.x, index * light.y, index)
        port = np.arange(2 * len(channels))
        order = np.abs(np.subtract.outer(port % len(channels), port % len(channels)))
        values = np.select([order == 0, order == 1], [zeroth, strength], 0.0) * scale
        values /= np.maximum(values.sum(axis=-1, keepdims=True), 1.0)
        values[..., port, port] = np.maximum(1.0 - values.sum(axis=-1), 0.0)
        return values[..., None].astype(np.float32)

    bands = tuple(
        Band(k, kind(k, cells.A), kind(k, cells.B) if k else None)
        for k in range(cells.largest_band(wavelengths, optical) + 1)
    )
    response, header = CellResponse(bands, even=True), {"profile": "weak"}
    return OrderTable((period, np.inf), wavelengths, response, header=header, block=index)


BLOCK = block_grating()
INDEX, WIDTH = 1.5, 65.0
STEP = 550.0 / (1e3 * BLOCK.period)


def indices(directions: Array) -> Array:
    """Index of the medium that directions (n, 3) are in."""
    return np.where(directions[:, 2] > 0.0, 1.0, INDEX)[:, None]


def near_orders(n: int = 60, seed: int = 3) -> tuple[Array, Array, Array]:
    """Pairs near the centres of orders 0 and ±1, on all sides, and the orders."""
    rng = np.random.default_rng(seed)
    wi, wo, orders = [], [], []
    while len(wi) < n:
        side = rng.choice([1.0, -1.0], 2)
        came, left = np.where(side > 0.0, 1.0, INDEX)
        radius, azimuth = np.sqrt(rng.random()) * 0.97, 2.0 * np.pi * rng.random()
        x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
        m = int(rng.integers(-1, 2))
        out = (np.array([m * STEP, 0.0]) - came * np.array([x, y])) + rng.normal(0.0, 2e-3, 2)
        square = 1.0 - (out @ out) / left**2
        if square > 0.01:
            wi.append([x, y, side[0] * np.sqrt(1.0 - radius**2)])
            wo.append([*(out / left), side[1] * np.sqrt(square)])
            orders.append(m)
    return np.array(wi), np.array(wo), np.array(orders)


def block_light(wi: Array, wo: Array, orders: Array) -> Array:
    """η k²σ²/π exp(−σ²|q − q_m|²) n² cosθo of light from ωi to ωo, per solid angle."""
    came, left = indices(wi), indices(wo)
    total = (came * wi + left * wo)[:, :2]
    wave = 2e3 * np.pi / 550.0
    sigma = WIDTH / 4.0
    lobe = np.exp(-((sigma * wave) ** 2) * ((total[:, 0] - orders * STEP) ** 2 + total[:, 1] ** 2))
    from_below, crosses = wi[:, 2] < 0.0, wi[:, 2] * wo[:, 2] < 0.0
    efficiency = np.zeros(len(wi))
    x, y = (-came * wi[:, :2]).T
    for below in (False, True):
        for transmitted in (False, True):
            here = (from_below == below) & (crosses == transmitted)
            efficiency[here] = BLOCK.efficiency(
                x[here], y[here], 550.0, orders[here], from_below=below, transmitted=transmitted
            )
    peak = (wave * sigma) ** 2 / np.pi
    return efficiency * peak * lobe * left[:, 0] ** 2 * np.abs(wo[:, 2])
