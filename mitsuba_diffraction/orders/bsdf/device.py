"""Look-ups of `lookup` inside a kernel: the grid on the device, and orders drawn (Dr.Jit)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ...plugin.loops import sum_of
from ...plugin.memory import HalfFloats, once_a_table, read, upload
from ...plugin.types import Float, Index, Mask
from ..efficiency import lookup_in
from ..grid import OrderGrid
from ..lookup import RAISED, Lookup
from ..table import OrderTable

#: Against division by 0, in single precision.
_MIN_DIVISOR, _SMALLEST = 1e-7, 2.0**-126


class Device:
    """A grid in the current variant's memory; a `lookup.Memory`."""

    def __init__(self, grid: OrderGrid) -> None:
        arrays = {k: v for k, v in grid._asdict().items() if isinstance(v, np.ndarray)}
        self._starts = {k: upload(mi.UInt32, v) for k, v in arrays.items() if v.ndim == 1}
        # corners hold a record of 8 for each of their parts
        shapes = {k: v.reshape(-1, 8) if k == "corners" else v for k, v in arrays.items()}
        self._records = {k: HalfFloats(v) for k, v in shapes.items() if v.ndim == 2}
        self.scale = self._records["corners"].scale

    def read(self, name: str, index: Index, numbers: int, active: Mask) -> Sequence[Float]:
        """See `Memory.read`."""
        packets = self._records[name].read(index, active)
        return [mi.Float(x) for packet in packets for x in packet][:numbers]

    def start(self, name: str, kind: Index) -> Index:
        """See `Memory.start`."""
        return read(mi.UInt32, self._starts[name], kind)

    @staticmethod
    def sum(count: Index, add: Callable[..., Float], inputs: Any, zero: Float) -> Float:
        """See `Memory.sum`."""
        return sum_of(count, add, inputs, mi.Float(0.0))


@once_a_table
def order_lookup(table: OrderTable) -> Lookup:
    """Return the look-up of a table in the current variant."""
    elements = mi.is_polarized and table.polarised
    return lookup_in(table, Device, coated=True, elements=elements, chances=True)


class Drawn(NamedTuple):
    """Order that is drawn; whether it leaves on the second side; and whether there is any."""

    order: Any
    below: Mask
    valid: Mask


def draw(lookup: Lookup, row: Any, sample: Float) -> Drawn:
    """Return an order drawn by its efficiency over `Lookup.total`."""
    if lookup.has_chances:
        return _drawn_at_a_corner(lookup, row, sample)
    target, ports = sample * lookup.total(row), mi.UInt32(lookup.ports(row))

    def body(port: Index, reached: Float) -> tuple[Index, Float]:
        order, below = lookup.order_at(row, port)
        share = lookup.share(row, order, True, below if lookup.sides == 2 else None)
        return port + 1, reached + share.chance

    def further(port: Index, reached: Float) -> Mask:
        return (reached <= target) & (port < ports)

    port, reached = dr.while_loop((mi.UInt32(0), mi.Float(0.0)), further, body)
    # of listed light, the last port's order may not propagate: no light
    return Drawn(*lookup.order_at(row, dr.select(port > 0, port - 1, 0)), reached > target)


def _drawn_at_a_corner(lookup: Lookup, row: Any, sample: Float) -> Drawn:
    """Draw a corner of a cell by its part of the sum, then an order by the chances at that node.

    Interpolation mixes the corners, so that both draws have the interpolated chances; and the
    orders of a node lie side by side in memory.
    """
    target, mirrored = sample * lookup.total(row), mi.Mask(False)
    if lookup.coated:  # the face's mirror direction comes first
        mirrored = target < row.face * RAISED
        target = (target - row.face * RAISED) * dr.rcp(dr.maximum(row.entering, _MIN_DIVISOR))
    node, rest, found, before = mi.UInt32(0), mi.Float(0.0), mi.Mask(False), mi.Float(0.0)
    corners = zip(lookup.nodes(row), row.weights, lookup.totals(row), strict=True)
    for corner, weight, total in corners:
        raised = weight * RAISED
        after = dr.fma(raised, total, before)
        here = (target >= before) & (target < after)
        node = dr.select(here, corner, node)
        rest = dr.select(here, (target - before) * dr.rcp(dr.maximum(raised, _SMALLEST)), rest)
        found, before = found | here, after
    ports = mi.UInt32(lookup.ports(row))
    records = (ports + 7) >> 3
    first = lookup.memory.start("chance_starts", row.kind) + (node * ports + row.entered) * records

    def body(n: Index, port: Index, reached: Float) -> tuple[Index, Index, Float]:
        for i, chance in enumerate(lookup.memory.read("chances", first + n, 8, row.lit)):
            port = dr.select(reached <= rest, n * 8 + i, port)
            reached = reached + chance
        return n + 1, port, reached

    def further(n: Index, port: Index, reached: Float) -> Mask:
        return (reached <= rest) & (n < records)

    state = mi.UInt32(0), mi.UInt32(0), mi.Float(0.0)
    _, port, reached = dr.while_loop(state, further, body)
    order, below = lookup.order_at(row, port)
    valid = found & (reached > rest)
    return Drawn(dr.select(mirrored, 0.0, order), mi.Mask(below) & ~mirrored, valid | mirrored)
