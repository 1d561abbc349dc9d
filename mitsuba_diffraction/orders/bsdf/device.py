"""Look-ups of `lookup` inside a kernel: the grid on the device, and orders drawn (Dr.Jit)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ...plugin.loops import sum_of
from ...plugin.memory import once_a_table, read, read_record, upload
from ...plugin.types import Buffer, Float, Index, Mask
from ..efficiency import AnyLookup, lookup_in
from ..grid import OrderGrid
from ..table import OrderTable


class Device:
    """A grid in the current variant's memory; a `lookup.Memory`."""

    def __init__(self, grid: OrderGrid) -> None:
        self._buffers: dict[str, Buffer] = {}
        for name, values in grid._asdict().items():
            if isinstance(values, np.ndarray):
                kind = mi.UInt32 if values.dtype == np.uint32 else mi.Float16
                self._buffers[name] = upload(kind, values)

    def read(self, name: str, index: Index, numbers: int, active: Mask) -> Sequence[Float]:
        """See `Memory.read`."""
        return [mi.Float(x) for x in read_record(self._buffers[name], index, numbers, active)]

    def start(self, name: str, kind: Index) -> Index:
        """See `Memory.start`."""
        return read(mi.UInt32, self._buffers[name], kind)

    @staticmethod
    def sum(count: Index, add: Callable[..., Float], inputs: Any, zero: Float) -> Float:
        """See `Memory.sum`."""
        return sum_of(count, add, inputs, mi.Float(0.0))


@once_a_table
def order_lookup(table: OrderTable) -> AnyLookup:
    """Return the look-up of a table in the current variant."""
    return lookup_in(table, Device, coated=True, elements=mi.is_polarized and table.polarised)


class Drawn(NamedTuple):
    """Order that is drawn; whether it leaves on the second side; and whether there is any."""

    order: Any
    below: Mask
    valid: Mask


def draw(lookup: AnyLookup, row: Any, sample: Float) -> Drawn:
    """Return an order drawn by its efficiency over `Lookup.total`."""
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
