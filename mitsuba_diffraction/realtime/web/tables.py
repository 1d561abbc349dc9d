"""Tables of a page, rounded to as many digits as fit into its size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...optics.colour import delta_e, linear_srgb, response
from ...optics.geometry import wavenumber
from ...orders import OrderTable, cells
from ...orders.cells import Counts
from ...orders.rows import kinds_of, wavelength_of
from ...plugin.description import Surface
from ...shading import orders
from ...tables import DiffractionTable
from ...tables.colour.table import cached_colours, colour_difference, power_colour_difference
from ...tables.powers import as_powers, powers_at
from ..glsl.packing import pack_colours, pack_powers
from ..glsl.solved import pack_orders
from ..glsl.texels import Packed, shortened
from .sections import converted

#: Binary digits of a series' largest number, fewer where tables are too large for a page; of the
#: most, the mean ΔE2000 stays below 0.1.
DIGITS = (9, 8, 7, 6)
#: Smallest rounding step relative to a table's largest number: more digits are not visible.
FLOOR = 2.0**-17

_ORDERS = 5  # largest number of orders that the page names
_ORDER_BYTES = 6 << 20  # size of efficiencies of solved orders before compression
_BANDS = 4  # bands of solved orders whose colours are compared


def web_table(method: str, described: Surface, digits: int) -> tuple[Packed, tuple[float, float]]:
    """Round a table to fewer binary digits for one of `WEB_METHODS`.

    `exact` does not support coherent tables.

    Returns textures, uniforms and definitions, and the mean and 99th percentile of ΔE2000 from the
    exact table.
    """
    packed, loss = (
        _solved(method, described.orders, described.sigma, digits)
        if described.solved
        else _modelled(method, described.patch, digits)
    )
    return packed, (float(loss.mean()), float(np.percentile(loss, 99.0)))


#: Table in fewer digits: textures, uniforms and definitions; ΔE2000 (n,) from the exact table.
Rounded = tuple[Packed, NDArray[np.float64]]


def _modelled(method: str, table: DiffractionTable, digits: int) -> Rounded:
    """Round a table of heights."""
    if method == "fast":
        colours = cached_colours(table)
        # rounded twice, so that the upper halves of floats, which the shader reads, are exact
        coefficients = shortened(rounded(colours.coefficients, digits, FLOOR)).astype(np.float16)
        fewer = replace(colours, coefficients=coefficients)
        return pack_colours(fewer), colour_difference(colours, fewer)
    powers = as_powers(table)
    less = replace(powers, coefficients=rounded(powers.coefficients, digits, FLOOR))
    return pack_powers(less), power_colour_difference(powers, less)


def _solved(method: str, table: OrderTable, sigma: float, digits: int) -> Rounded:
    """Round a table of solved orders, and take fewer cells."""
    packed = pack_orders(method, table, sigma, _ORDER_BYTES)
    counts = orders.pack_orders(table, _ORDER_BYTES).counts
    width = 4 * (counts.rho + 1)

    def fewer(data: NDArray[np.floating]) -> NDArray[np.float16]:
        return rounded(data.reshape(-1, width), digits, FLOOR).reshape(data.shape)

    less = converted(packed, {"efficiencies": fewer})
    return less, _solved_loss(table, counts, digits)


def _solved_loss(table: OrderTable, counts: Counts, digits: int) -> NDArray[np.float64]:
    """Return the ΔE2000 (n,) of orders in the middles of cells, which are farthest from nodes."""

    def stored(nodes: Real) -> NDArray[np.float16]:
        return rounded(nodes.transpose(0, 3, 4, 2, 1), digits).transpose(0, 4, 3, 1, 2)

    losses = []
    of_bands = [of for of in kinds_of(table) if of.kind == cells.A]
    for of in of_bands[:: max(1, len(of_bands) // _BANDS)]:
        exact, face, read = orders.centres(table, of, counts, stored)
        rho, w = ((np.arange(n) + 0.5) / n for n in (counts.rho, counts.w))
        lam = wavelength_of(table, (of.band + cells.sine_squared(rho))[:, None], w)
        colours = linear_srgb(response(lam.ravel())).reshape(*lam.shape, 1, 1, 3)
        passed = (face / np.maximum(exact, 1e-12))[..., None] * colours
        difference = delta_e(exact[..., None] * passed, read[..., None] * passed)
        losses.append(difference[np.isfinite(difference)])
    return np.concatenate(losses)


def rounded(values: NDArray[np.floating], bits: int, floor: float = 0.0) -> NDArray[np.float16]:
    """Round each row (…, n) to multiples of 2^-bits of its largest number's power of two.

    A row is one series, whose terms are added up, so they get one absolute error.

    floor : smallest step relative to the power of two of all rows' largest number.
    """
    exact = values.astype(np.float32)
    largest = np.maximum(np.abs(exact).max(axis=-1, keepdims=True), 2.0**-24)
    powers = np.exp2(np.ceil(np.log2(largest)))
    step = np.maximum(powers * 2.0**-bits, powers.max() * floor)
    return (np.round(exact / step) * step).astype(np.float16)


def strongest_orders(described: Surface) -> list[list[float]]:
    """Return the brightest separate orders in green light along the normal.

    Each entry has q_x and q_y in rad/µm, and the share of the light; a pair ±q has one entry. The
    list is empty for a coherent table; solved orders have the first.
    """
    if described.orders is not None:
        return [[2.0 * np.pi / described.orders.period, 0.0, 1.0]]
    table = described.patch
    if table.grid.coherent:
        return []
    powers = powers_at(table, float(2.0 * wavenumber(550.0))).astype(float)
    last = np.array(table.grid.last)
    y, x = np.divmod(np.argsort(powers, axis=None)[::-1], powers.shape[1])
    q = (np.stack([x, y], axis=1) - last) * table.spacing
    shares, separation = np.sort(powers, axis=None)[::-1], 2.0 / table.sigma
    orders: list[list[float]] = []
    for position, share in zip(q, shares, strict=True):
        if len(orders) == _ORDERS or share <= 1e-5:
            break
        others = np.array([order[:2] for order in orders] or [[0.0, 0.0]])
        distances = np.minimum(
            *(np.linalg.norm(others - sign * position, axis=1) for sign in (1.0, -1.0))
        )
        if min(distances.min(), np.linalg.norm(position)) > separation:
            orders.append([float(position[0]), float(position[1]), float(share)])
    return orders
