"""Efficiencies of solved orders as a texture, which shaders read like orders/lookup.py.

`order_row` and `order_texel` are formulas of `optics.arithmetic` that shaders get as functions.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..optics import arithmetic
from ..optics.arithmetic import Number
from ..optics.orders import (
    cell_wavelengths,
    least_c,
    order_cell,
    smooth_coordinate,
    wavelength_coordinate,
)
from ..orders import OrderTable
from ..orders.cells import Counts
from ..orders.rows import Kind, kept, kinds_of, middles, rows

#: Cells of a tile along τ, ρ and w, in air and under a layer, whose critical angles lie along w.
CELLS, CELLS_UNDER_LAYER = Counts(32, 24, 6), Counts(20, 14, 12)
_WIDEST = 1 << 12  # texels in a row: every OpenGL 3.3 and nearly every WebGL 2 has as many


class PackedOrders(NamedTuple):
    """Efficiencies of a table on even grids, with all reflections within a clear layer.

    Bands follow each other, kind A of a band before its kind B. A kind has for each channel j of
    the incident light a tile (τ, ρ) for each channel of the leaving light, and one for their sum
    outside of the layer. A texel has four neighbours along w, and a tile a group of columns for
    every three cells of w.

    Attributes
    ----------
    pixels : (height, width, 4) float16.
    counts : cells along τ, ρ and w, the last a multiple of 3.
    columns : tiles in a row of the texture.
    """

    pixels: NDArray[np.float16]
    counts: Counts
    columns: int


def texture_constants(table: OrderTable, packed: PackedOrders) -> dict[str, float]:
    """Return the constants with which shaders read the texture of a table; lengths in µm."""
    low, high, least, most = (1e-3 * end for end in (*table.wavelengths, *table.reach))
    return {
        "period": table.period,
        "superstrate": table.superstrate,
        "kept": kept(table),
        "least_c": least_c(table.superstrate),
        "last_band": float(table.last_band),
        "shortest": low, "longest": high, "shortest_lit": least, "longest_lit": most,
        "tau_cells": float(packed.counts.tau),
        "rho_cells": float(packed.counts.rho),
        "w_cells": float(packed.counts.w),
        "tiles_across": float(packed.columns),
    }  # fmt: skip


class OrderRow(NamedTuple):
    """Light of one direction and wavelength, placed in the texture.

    Attributes
    ----------
    lit : 1, or 0 of a wavelength that the table does not reflect.
    channel, channels : j of the incident light, and number of channels.
    tile : number of the tile of j and the first channel of the leaving light.
    place : τ, ρ and w, 0 to 1 each.
    """

    lit: Number
    channel: Number
    channels: Number
    tile: Number
    place: tuple[Number, Number, Number]


def order_row(
    x: Number, y: Number, wavelength: Number, period: Number, superstrate: Number,
    last_band: Number, least_c: Number, shortest: Number, longest: Number,
    shortest_lit: Number, longest_lit: Number,
) -> OrderRow:  # fmt: skip
    """Return where the texture of solved orders has light of a direction and wavelength.

    x, y : tangential part of ωi; others : wavelength in vacuum, and `texture_constants`.
    """
    xp = arithmetic.of(x, y, wavelength)
    lit = xp.where((wavelength >= shortest_lit) & (wavelength <= longest_lit), 1.0, 0.0)
    lam = xp.maximum(wavelength, shortest)
    inverse = superstrate * period / lam
    cell = order_cell(-x / superstrate, y / superstrate, inverse, last_band, 1e-7)
    ends = cell_wavelengths(lam / cell.c, shortest, longest, least_c)
    w = wavelength_coordinate(lam, *ends, 1e-6)
    k, is_a = cell.band, xp.where(cell.kind_a, 1.0, 0.0)
    channels = k + is_a
    # tiles of all lower bands, and of kind A before kind B; each j has one more, of the sum over q
    lower = xp.floor(k * (k + 1.0) * (2.0 * k + 1.0) / 3.0 + 0.5)
    tile = lower + (1.0 - is_a) * (k + 1.0) * (k + 2.0) + cell.channel * (channels + 1.0)
    place = smooth_coordinate(cell.t), smooth_coordinate(cell.r), w
    return OrderRow(lit, cell.channel, channels, tile, place)


def order_texel(
    tile: Number, tau: Number, rho: Number, w: Number,
    tau_cells: Number, rho_cells: Number, w_cells: Number, tiles_across: Number,
) -> tuple[Number, Number, Number]:  # fmt: skip
    """Return the column and row of a tile's place in the texture, and how far along its four w."""
    xp = arithmetic.of(tile, tau, rho, w)
    group = xp.minimum(xp.floor(w * w_cells / 3.0), w_cells / 3.0 - 1.0)
    down = xp.floor((tile + 0.5) / tiles_across)
    column = ((tile - down * tiles_across) * (w_cells / 3.0) + group) * (rho_cells + 1.0)
    row = down * (tau_cells + 1.0)
    return column + rho * rho_cells + 0.5, row + tau * tau_cells + 0.5, w * w_cells - 3.0 * group


#: Numbers of parameters of the formulas.
FORMULAS: dict[Callable[..., Any], int] = {order_row: 11, order_texel: 8}


@functools.lru_cache(maxsize=4)
def pack_orders(table: OrderTable, most_bytes: int) -> PackedOrders:
    """Resample a table for a texture of a size at most."""
    counts = _cells_within(table, most_bytes)
    groups = 3 * np.arange(counts.w // 3)[:, None] + np.arange(4)
    tiles = []
    for of in kinds_of(table):
        values = rows(table, of, counts)
        whole = values.through.sum(axis=-1, keepdims=True)
        row = np.concatenate([values.within, whole], axis=-1).astype(np.float16)
        # (τ, ρ, group, w, j, q) to (tile, τ, group ρ, w)
        row = row[:, :, groups].transpose(4, 5, 0, 2, 1, 3)
        tiles.append(row.reshape(-1, counts.tau + 1, len(groups) * (counts.rho + 1), 4))
    joined = np.concatenate(tiles)
    _, height, width, _ = joined.shape
    columns = _WIDEST // width
    joined = np.pad(joined, [(0, -len(joined) % columns), (0, 0), (0, 0), (0, 0)])
    picture = joined.reshape(-1, columns, height, width, 4).swapaxes(1, 2)
    return PackedOrders(picture.reshape(-1, columns * width, 4), counts, columns)


def _cells_within(table: OrderTable, most_bytes: int) -> Counts:
    """Return the numbers of cells of a texture of a size at most."""
    counts = CELLS if table.superstrate == 1.0 else CELLS_UNDER_LAYER
    tiles = sum(of.ports * (of.ports + 1) for of in kinds_of(table))
    while max(counts) > 4:
        half_floats = (counts.tau + 1) * (counts.rho + 1) * (counts.w // 3) * 4
        if 2 * half_floats * tiles <= most_bytes:
            break
        tau, rho, w = (max(min(n, 4), 3 * n // 4) for n in counts)
        counts = Counts(tau, rho, max(w - w % 3, 3))
    return counts


def centres(
    table: OrderTable, of: Kind, counts: Counts, stored: Callable[[Real], NDArray[np.float16]]
) -> tuple[Real, Real, Real]:
    """Return efficiencies (τ, ρ, w, j, q) in the middles of cells, which are farthest from nodes.

    They are exact, exact outside of the layer (`Rows.through`), and interpolated between nodes.

    stored : function that returns the nodes' values as a texture stores them.
    """
    fine = rows(table, of, Counts(*(2 * n for n in counts)))
    exact, through = (values[1::2, 1::2, 1::2] for values in fine)
    return exact, through, middles(stored(fine.within[::2, ::2, ::2]).astype(np.float64))
