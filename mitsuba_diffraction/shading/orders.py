"""Efficiencies of solved orders as a texture, which shaders read like orders/lookup.py."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..orders import OrderTable
from ..orders.cells import Counts
from ..orders.rows import Kind, kinds_of, middles, rows

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
