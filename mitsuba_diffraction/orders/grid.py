"""Records of a table, which its look-up interpolates linearly, in NumPy as in kernels.

Numbers are half floats times a power of two, so that the largest is near their limit: orders down
to 1e-8 of the light are as exact, relatively, as strong ones.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import NamedTuple

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

    def efficiencies(of: Kind) -> list[Real]:
        if table.block:
            return [blocks.reduced(table, of)]
        of_kind = rows(table, of, counts, coated=coated)
        return list(of_kind if coated and table.superstrate != 1.0 else of_kind[:1])

    def matrices(of: Kind) -> Real:
        values = table.bands[of.band].kinds[of.kind].astype(np.float64)
        if values.shape[-1] == MUELLER:
            values = smooth_elements(table, of.band, values)
        return resampled(table, of.band, values, counts, coated).reshape(-1, values.shape[-1])

    def at_nodes(efficiencies: Real) -> Real:
        missing = -efficiencies.shape[-1] % 8
        return np.pad(efficiencies, [(0, 0)] * 4 + [(0, missing)]).reshape(-1, 8)

    kinds = list(kinds_of(table))
    parts = list(map(efficiencies, kinds))
    starts, corners, scale = _corners(parts)
    grid = OrderGrid(counts, starts, corners, None, starts, scale)
    if elements and table.response.elements > 1:
        element_starts, stored = _joined(map(matrices, kinds), scale)
        grid = grid._replace(elements=stored, element_starts=element_starts)
    if chances and not table.block:
        chance_starts, stored = _joined((at_nodes(of_kind[-1]) for of_kind in parts), scale)
        grid = grid._replace(chances=stored, chance_starts=chance_starts)
    return grid


def _listed(table: OrderTable, response: ListedResponse, elements: bool) -> OrderGrid:
    """Return the records of listed light; single lights along an axis are a cell of equal ends."""
    raw = response.values.astype(np.float64)
    parts = [raw] if response.index is None else [_without_anomalies(table, response), raw]
    for axis in range(3):
        if raw.shape[axis] == 1:
            parts = [np.repeat(part, 2, axis=axis) for part in parts]
    shape = parts[0].shape
    counts, starts = Counts(*(n - 1 for n in shape[:3])), np.zeros(1, np.uint32)
    _, corners, scale = _corners([[part[..., 0] for part in parts]])
    matrices = None
    if elements and shape[-1] > 1:
        matrices = (parts[0].reshape(-1, shape[-1]) / scale).astype(np.float32)
    return OrderGrid(counts, starts, corners, matrices, starts, scale)


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


def _corners(kinds: list[list[Real]]) -> tuple[NDArray[np.uint32], NDArray[np.float32], float]:
    """Return the first record of each kind, all records at corners, and the scale of both.

    kinds : of each kind its parts, efficiencies (τ, ρ, w, …, ports) at nodes; their sums follow
        the ports. Corners of a cell are 000, 001, 010 … 111.
    """
    nodes = [[_with_sum(part) for part in parts] for parts in kinds]
    largest = max(float(part.max()) for parts in nodes for part in parts)
    scale = 2.0 ** math.ceil(math.log2(max(largest, 1e-30) / _LARGEST))
    shapes = [(*(n - 1 for n in part.shape[:3]), *part.shape[3:]) for part, *_ in nodes]
    sizes = list(map(math.prod, shapes))
    records = np.empty((sum(sizes), len(nodes[0]), 8), np.float32)
    pairs = list(itertools.product((slice(-1), slice(1, None)), repeat=3))
    of_kinds = np.split(records, np.cumsum(sizes)[:-1])
    for parts, shape, of_kind in zip(nodes, shapes, of_kinds, strict=True):
        for n, part in enumerate(parts):
            stored = (part / scale).astype(np.float32)
            for corner, pair in enumerate(pairs):
                of_kind[:, n, corner].reshape(shape)[...] = stored[pair]
    return _starts(sizes), records.reshape(len(records), -1), scale


def _with_sum(values: Real) -> Real:
    """Return efficiencies (…, ports) followed by their sum."""
    return np.concatenate([values, values.sum(axis=-1, keepdims=True)], axis=-1)


def _joined(kinds: Iterable[Real], scale: float) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    """Return the first record of each kind, and the records (n, …) of all, over the scale."""
    stored = [(records / scale).astype(np.float32) for records in kinds]
    return _starts(list(map(len, stored))), np.concatenate(stored)


def _starts(records: list[int]) -> NDArray[np.uint32]:
    """Return the first record of each kind of each band; kind B of band 0 has none."""
    return np.cumsum([0, records[0], 0, *records[1:]])[:-1].astype(np.uint32)
