"""The tables of a page: as many digits of them as fit."""

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
from .sections import Section, as_columns, packed_array

#: What a page can draw with.
WEB_METHODS = ("lut", "spectral")

#: Binary digits that are tried, from the largest page to the smallest.
DIGITS = (9, 8, 7, 6)

_ORDERS = 5  # that are named, at most
_LARGE = 1 << 20  # entries of the textures that are rounded


@dataclass(frozen=True)
class WebTable:
    """One table for one method."""

    packed: Packed  # textures, uniforms and definitions for the shader, rounded
    sections: dict[str, Section]  # of the textures, by name
    # mean and 99th percentile of ΔE2000 against the table that was not rounded
    loss: tuple[float, float]

    @property
    def nbytes(self) -> int:
        """Bytes of its sections."""
        return sum(len(section.data) for section in self.sections.values())


def web_table(method: str, table: DiffractionTable, digits: int) -> WebTable:
    """A table with fewer binary digits, for one of `WEB_METHODS`; not `spectral` where coherent."""
    if method == "lut":
        colours = cached_colours(table)
        # halves that the shader can read
        coefficients = shortened(rounded(colours.coefficients, digits)).astype(np.float16)
        fewer = replace(colours, coefficients=coefficients, order_0=shortened(colours.order_0))
        packed, loss = pack_colours(fewer), colour_difference(colours, fewer)
        width = fewer.coefficients.shape[-1] // 2  # two numbers a word
    else:
        series, order_0, scale, expansion = power_series(table)
        powers = replace(
            table, coefficients=series[:, :, :, None], order_0=order_0[:, None], scale=scale,
            expansion=expansion,
        )  # fmt: skip
        less = replace(powers, coefficients=rounded(powers.coefficients, digits))
        packed, loss = pack_powers(less), power_colour_difference(powers, less)
        width = 4 * int(packed.definitions["TEXELS"])
    sections = {}
    for texture in packed.textures:
        channels = texture.data.shape[2]
        sections[texture.name] = packed_array(
            as_columns(texture.data, width if texture.data.size > _LARGE else channels)
        )
    return WebTable(packed, sections, (float(loss.mean()), float(np.percentile(loss, 99.0))))


def rounded(values: NDArray[np.floating], bits: int) -> NDArray[np.float16]:
    """Each row (…, n) rounded to multiples of 2^-bits of its largest number's power of two.

    A row is one series: what is added up has one absolute error. As half floats the results end in
    zeros, which compress.
    """
    exact = values.astype(np.float32)
    largest = np.abs(exact).max(axis=-1, keepdims=True)
    step = np.exp2(np.ceil(np.log2(np.maximum(largest, 2.0**-24))) - bits)
    return (np.round(exact / step) * step).astype(np.float16)


def fitting_tables(
    methods: Sequence[str], tables: Sequence[DiffractionTable], room: int, progress: Progress
) -> dict[tuple[str, int], WebTable] | int:
    """Tables for all methods with as many digits as fit into a number of bytes.

    Returns those by method and number of the table; or, if nothing fits, the least bytes it takes.
    """
    least = 0
    for digits in DIGITS:
        found: dict[tuple[str, int], WebTable] = {}
        for method in methods:
            for number, table in enumerate(tables):
                done = len(found)
                progress(done, len(methods) * len(tables), f"{method}, {digits} digits")
                found[method, number] = web_table(method, table, digits)
        least = sum(one.nbytes for one in found.values())
        if least <= room:
            return found
    return least


def strongest_orders(table: DiffractionTable) -> list[list[float]]:
    """The few brightest orders in green light along the normal, each apart from the others.

    Returns q_x and q_y of each, rad/µm, and its share of the light; of a pair ±q one. None of a
    table whose orders interfere.
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
    shares, apart = np.sort(powers, axis=None)[::-1], 2.0 / table.sigma
    found: list[list[float]] = []
    for at, share in zip(q, shares, strict=True):
        if len(found) == _ORDERS or share <= 1e-5:
            break
        taken = np.array([one[:2] for one in found] or [[0.0, 0.0]])
        near = np.minimum(*(np.linalg.norm(taken - sign * at, axis=1) for sign in (1.0, -1.0)))
        if min(near.min(), np.linalg.norm(at)) > apart:
            found.append([float(at[0]), float(at[1]), float(share)])
    return found
