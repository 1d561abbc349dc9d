"""Tables of a page, rounded to as many digits as fit into its size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...optics.geometry import wavenumber
from ...progress import Progress
from ...tables.colour.table import colour_difference, power_colour_difference
from ...tables.powers import power_series
from ...tables.store import cached_colours
from ...tables.table import DiffractionTable
from ..glsl.packing import pack_colours, pack_powers
from ..glsl.texels import Packed, shortened
from .sections import Section, as_columns, packed_array, packed_series

#: Methods that a page supports.
WEB_METHODS = ("fast", "exact")

#: Binary digits of a series' largest number; the mean ΔE2000 stays below 0.1.
DIGITS = 9
#: Smallest rounding step relative to a table's largest number: more digits are not visible.
FLOOR = 2.0**-19

_FEWER = range(4)  # digits that may be left out of tables that are too large for a page

_ORDERS = 5  # largest number of orders that the page names
_LARGE = 1 << 20  # least number of entries of rounded textures


@dataclass(frozen=True)
class WebTable:
    """Rounded table for one method."""

    packed: Packed  # textures, uniforms and definitions for the shader
    sections: dict[str, Section]  # compressed textures, by name
    loss: tuple[float, float]  # mean and 99th percentile of ΔE2000 from the exact table

    @property
    def nbytes(self) -> int:
        """Number of bytes of the sections."""
        return sum(len(section.data) for section in self.sections.values())


def web_table(method: str, table: DiffractionTable, digits: int) -> WebTable:
    """Round a table to fewer binary digits for one of `WEB_METHODS`.

    `exact` does not support coherent tables.
    """
    if method == "fast":
        colours = cached_colours(table)
        # rounded twice, so that the upper halves of floats, which the shader reads, are exact
        coefficients = shortened(rounded(colours.coefficients, digits, FLOOR)).astype(np.float16)
        fewer = replace(colours, coefficients=coefficients, order_0=shortened(colours.order_0))
        packed, loss = pack_colours(fewer), colour_difference(colours, fewer)
        width = fewer.coefficients.shape[-1] // 2  # a word has two numbers
    else:
        series, order_0, scale, expansion = power_series(table)
        powers = replace(
            table, coefficients=series[:, :, :, None], order_0=order_0[:, None], scale=scale,
            expansion=expansion,
        )  # fmt: skip
        less = replace(powers, coefficients=rounded(powers.coefficients, digits, FLOOR))
        packed, loss = pack_powers(less), power_colour_difference(powers, less)
        width = 4 * int(packed.definitions["TEXELS"])
    sections = {}
    for texture in packed.textures:
        data, channels = texture.data, texture.data.shape[2]
        sections[texture.name] = (
            packed_series(as_columns(data, width))
            if data.size > _LARGE
            else packed_array(as_columns(data, channels))
        )
    return WebTable(packed, sections, (float(loss.mean()), float(np.percentile(loss, 99.0))))


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


def fitting_tables(
    methods: Sequence[str], tables: Sequence[DiffractionTable], room: int, progress: Progress
) -> dict[tuple[str, int], WebTable] | int:
    """Round tables for all methods to `DIGITS`, or to fewer if they exceed `room` bytes.

    Returns the tables by method and number, or the number of bytes that is needed if none fit.
    """
    needed = 0
    for fewer in _FEWER:
        rounded_tables: dict[tuple[str, int], WebTable] = {}
        for method in methods:
            for number, table in enumerate(tables):
                done = len(rounded_tables)
                digits = DIGITS - fewer
                progress(done, len(methods) * len(tables), f"{method}, {digits} digits")
                rounded_tables[method, number] = web_table(method, table, digits)
        needed = sum(web.nbytes for web in rounded_tables.values())
        if needed <= room:
            return rounded_tables
    return needed


def strongest_orders(table: DiffractionTable) -> list[list[float]]:
    """Return the brightest separate orders in green light along the normal.

    Each entry has q_x and q_y in rad/µm, and the share of the light; a pair ±q has one entry. The
    list of a coherent table is empty.
    """
    if table.grid.coherent:
        return []
    series, _, scale, expansion = power_series(table)
    kappa = np.array(2.0 * wavenumber(550.0))
    weights = expansion.weights(kappa)
    powers = series[int(expansion.interval(kappa))].astype(float) @ weights / scale
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
