"""Surfaces with solved orders for shaders: efficiencies as a texture, and lobes."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from ...arrays import Real
from ...orders import OrderTable
from ...orders.daylight import ENDS, daylight_weights
from ...orders.rows import leaving_transmittance
from ...shading import orders
from .lobes import AZIMUTHS, RINGS
from .texels import Packed, Texture

#: Largest size of the efficiencies, bytes.
MOST_BYTES = 48 << 20

# lobes: directions and wavelengths of the mean efficiencies
_DIRECTIONS, _WAVELENGTHS = 32, 24


def pack_orders(
    method: str, table: OrderTable, sigma: float, most_bytes: int = MOST_BYTES
) -> Packed:
    """Pack a table for a method, `fast` or `exact`.

    sigma : standard deviation of the amplitude window, µm.
    most_bytes : size of the efficiencies at most.
    """
    packed = orders.pack_orders(table, most_bytes)
    efficiencies = Packed(
        (Texture("efficiencies", packed.pixels, smooth=True),),
        {"sigma": sigma, **orders.texture_constants(table, packed)},
        {"ORDERS": "", **({} if table.superstrate == 1.0 else {"FACE": ""})},
    )
    if method != "fast":
        return efficiencies
    weights = daylight_weights(sigma, table.period)
    smoothed = weights.smoothed.astype(np.float16)
    order_0 = np.column_stack([weights.order_0[:, :3], 1e-3 * weights.wavelengths])
    return efficiencies | Packed(
        (
            Texture("daylight", smoothed, smooth=True),
            Texture("order_0", order_0[None].astype(np.float32)),
        ),
        {"daylight_waves": weights.waves, "daylight_variances": weights.variances},
        {"DAYLIGHT": ""},
    )


def order_power(table: OrderTable, sigma: float, edges: Real) -> Real:
    """Return the brightness of all orders in the cells (rings, azimuths) between radii `edges`.

    Efficiencies are means over directions; layers only pass and mirror. Lobes of orders other than
    0 are as wide as they are only around the axis: along it, wavelengths spread them further.
    """
    index = table.superstrate
    radius = np.sqrt((np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS)
    turn = 2.399963 * np.arange(_DIRECTIONS)  # sunflower spiral
    x, y = ((radius / index * part)[:, None] for part in (np.cos(turn), np.sin(turn)))
    through = np.ones(_DIRECTIONS)
    if index > 1.0:
        through = leaving_transmittance((radius / index) ** 2, index)
    daylight = np.diff(daylight_weights(sigma, table.period).cumulative)
    lam = ENDS[0] + (np.arange(len(daylight)) + 0.5) * (ENDS[1] - ENDS[0]) / len(daylight)
    some = np.linspace(*ENDS, _WAVELENGTHS)
    lit = (some >= table.reach[0]) & (some <= table.reach[1])
    deviation = 1e-3 * lam / (2.0 * np.pi * np.sqrt(2.0) * sigma)
    around = np.linspace(-np.pi, np.pi, AZIMUTHS + 1)  # edges of azimuths

    def power(order: int) -> Real:
        """Return the mean efficiency at all wavelengths, as bright as these are."""
        efficiency = lit * table.efficiency(x, y, np.clip(some, *table.reach), order)
        mean = (through[:, None] * efficiency).mean(axis=0)
        if order == 0:
            mean = mean + (1.0 - through).mean()
        return np.asarray(daylight * np.interp(lam, some, mean))

    within = power(0) @ -np.expm1(-0.5 * (edges / deviation[:, None]) ** 2)
    cell_power = np.diff(within)[:, None] * np.full(AZIMUTHS, 1.0 / AZIMUTHS)
    for order in range(1, int(2e3 * table.period / ENDS[0]) + 1):
        radii = order * 1e-3 * lam / table.period
        rings = np.clip(np.searchsorted(edges, radii) - 1, 0, RINGS - 1)
        across = np.clip(around, -0.5 * np.pi, 0.5 * np.pi)
        spread = np.diff(ndtr((radii / deviation)[:, None] * np.sin(across)), axis=1)
        for sign, first in ((1, AZIMUTHS // 2), (-1, 0)):
            lobes = power(sign * order)[:, None] * np.roll(spread, first, axis=1)
            np.add.at(cell_power, rings, lobes)
    return np.asarray(cell_power)
