"""Records of a table, which its look-up interpolates linearly, in NumPy as in kernels.

Numbers are half floats times a power of two, so that the largest is near their limit: orders down
to 1e-8 of the light are as exact, relatively, as strong ones.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..optics.orders import crossed_square, order_factor
from . import blocks
from .cells import Counts
from .listed import mirror_of
from .polarised import MIN_ANGLE, TurnedAxes, about_s, smooth_elements, turned_axes
from .response import MUELLER, ListedResponse
from .rows import Kind, cells_of, kinds_of, on_cells, resampled, rows
from .table import OrderTable

#: Largest number that a half float shall hold; 65504 is its limit.
_LARGEST = 32768.0
#: Squared cosine of an order from which on its ratio to `order_factor` is known at a node.
_LEAST_SQUARE = 4e-4


class OrderGrid(NamedTuple):
    """Records of a table at the corners of cells.

    Attributes
    ----------
    cells : numbers of cells along the three coordinates of light.
    starts : first record of each kind of each band; one number for listed light.
    corners : (records, 8 × parts) float32, M₀₀ at the corners 000, 001, 010 … 111 of a cell: of n
        ports a cell has rows of n + 1 records, the ports' and their sum, one for each port that
        light comes through; of listed light one for each side. Under a coat two parts:
        efficiencies within it, and chances of drawing; also of listed light with an index, whose
        first part, as its elements, are ratios (`ListedResponse.index`).
    elements : (records, n) float32, the first n elements of the Mueller matrix at each node and
        pair of ports; over cells the odd ones over y. None without polarisation.
    element_starts : as `starts`, of `elements`.
    scale : factor from stored numbers to efficiencies.
    chances : (records, 8) float32, to draw an order at a node: of each node and port that light
        comes through the chances of all ports side by side, filled up with zeros to whole records.
        None where nothing is drawn, of blocks and of listed light.
    chance_starts : as `starts`, of `chances`.
    """

    cells: Counts
    starts: NDArray[np.uint32]
    corners: NDArray[np.float32]
    elements: NDArray[np.float32] | None
    element_starts: NDArray[np.uint32]
    scale: float
    chances: NDArray[np.float32] | None = None
    chance_starts: NDArray[np.uint32] | None = None

    @property
    def parts(self) -> int:
        """Numbers that a port has at a corner."""
        return self.corners.shape[1] // 8


def grid_of(table: OrderTable, *, coated: bool, elements: bool, chances: bool) -> OrderGrid:
    """Return the records of a table.

    coated : whether the reflections between the flat face of its superstrate and the grating are
        in the efficiencies; otherwise these are of the grating alone.
    elements : whether the grid has elements of Mueller matrices, where the table has any.
    chances : whether the grid has chances of orders at nodes, where its corners mix linearly.
    """
    response = table.response
    if isinstance(response, ListedResponse) and not (coated and table.superstrate != 1.0):
        return _listed(table, response, elements)
    table = on_cells(table)
    counts = cells_of(table, coated=coated)
    if table.block:
        counts = Counts(*(n - 1 for n in table.bands[0].counts))

    at_nodes: list[Real] = []

    def records(of: Kind) -> Real:
        if table.block:
            return corner_records(blocks.reduced(table, table.bands[of.band], of.kind))
        of_kind = rows(table, of, counts, coated=coated)
        parts = of_kind if coated and table.superstrate != 1.0 else of_kind[:1]
        missing = -parts[-1].shape[-1] % 8
        at_nodes.append(np.pad(parts[-1], [(0, 0)] * 4 + [(0, missing)]).reshape(-1, 8))
        return np.concatenate([corner_records(part) for part in parts], axis=-1)

    def nodes(of: Kind) -> Real:
        values = table.bands[of.band].kind(of.kind).astype(np.float64)
        if values.shape[-1] == MUELLER:
            values = smooth_elements(table, of.band, values)
        return resampled(table, of.band, values, counts, coated).reshape(-1, values.shape[-1])

    kinds = list(kinds_of(table))
    starts, corners = _joined(list(map(records, kinds)))
    matrices, element_starts = None, starts
    if elements and table.response.elements > 1:
        element_starts, matrices = _joined(list(map(nodes, kinds)))
    grid = _scaled(counts, starts, corners, matrices, element_starts)
    if not chances or table.block:
        return grid
    chance_starts, values = _joined(at_nodes)
    stored = (values / grid.scale).astype(np.float32)
    return grid._replace(chances=stored, chance_starts=chance_starts)


def _listed(table: OrderTable, response: ListedResponse, elements: bool) -> OrderGrid:
    """Return the records of listed light; single lights along an axis are a cell of equal ends."""
    raw = response.values.astype(np.float64)
    parts = [raw] if response.index is None else [_without_anomalies(table, response), raw]
    for axis in range(3):
        if raw.shape[axis] == 1:
            parts = [np.repeat(part, 2, axis=axis) for part in parts]
    shape = parts[0].shape
    counts, starts = Counts(*(n - 1 for n in shape[:3])), np.zeros(1, np.uint32)
    matrices = parts[0].reshape(-1, shape[-1]) if elements and shape[-1] > 1 else None
    records = np.concatenate([corner_records(part[..., 0]) for part in parts], axis=-1)
    return _scaled(counts, starts, records, matrices, starts)


def _without_anomalies(table: OrderTable, response: ListedResponse) -> Real:
    """Return a crossed grating's elements over their factors, as `ListedResponse.values`.

    For incident light about s, which goes round with φ; along the normal each φ has its own.
    """
    assert response.index is not None
    lam, theta, phi = np.meshgrid(*response.axes, indexing="ij")
    theta = np.maximum(theta, MIN_ANGLE)
    x, y, lam = (part[..., None] for part in (*mirror_of(theta, phi), lam))
    shifts = (m * lam * 1e-3 / d for m, d in zip(response.orders.T, table.periods, strict=True))
    left = crossed_square(x, y, *shifts)
    came, zeroth = 1.0 - x * x - y * y + 0.0 * left, ~response.orders.any(axis=1)
    scale = order_factor(came, left, zeroth, response.index)
    values, axes = list(np.moveaxis(response.values, -1, 0).astype(np.float64)), turned_axes(x, y)
    axes = TurnedAxes(*(part[:, :, :, None] for part in axes))
    known = (left > _LEAST_SQUARE)[:, :, :, None]
    turned = np.stack(about_s(values, axes), axis=-1)
    return blocks.divided(turned, scale[:, :, :, None], known)


def _scaled(
    counts: Counts, starts: NDArray[np.uint32], corners: Real, elements: Real | None,
    element_starts: NDArray[np.uint32],
) -> OrderGrid:  # fmt: skip
    scale = half_scale(corners)
    stored = None if elements is None else (elements / scale).astype(np.float32)
    return OrderGrid(
        counts, starts, (corners / scale).astype(np.float32), stored, element_starts, scale
    )


def half_scale(values: NDArray[Any]) -> float:
    """Return the power of two by which numbers are divided before they are stored."""
    return float(2.0 ** math.ceil(math.log2(max(float(values.max()), 1e-30) / _LARGEST)))


def corner_records(values: Real) -> Real:
    """Return efficiencies (…, ports), then their sum, at the corners of all cells, (n, 8).

    CellResponse lie along the first three axes; corners are 000, 001, 010 … 111.
    """
    whole = np.concatenate([values, values.sum(axis=-1, keepdims=True)], axis=-1)
    pairs = itertools.product((slice(-1), slice(1, None)), repeat=3)
    return np.stack([whole[pair] for pair in pairs], axis=-1).reshape(-1, 8)


def _joined(parts: list[Real]) -> tuple[NDArray[np.uint32], Real]:
    """Return the first record of each kind of each band, and all records of the kinds."""
    parts[1:1] = [parts[0][:0]]  # kind B of band 0 has none
    starts = np.cumsum([0, *map(len, parts[:-1])])
    return starts.astype(np.uint32), np.concatenate(parts)
