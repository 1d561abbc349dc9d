"""Upload arrays to the variant's device and gather from them.

Hides the difference between JIT and scalar variants.
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .types import Buffer, Float, Index, Kind, Mask, Packet

#: Largest number of floats that one packet load fetches.
PACKET = 16

Table = TypeVar("Table")
Shared = TypeVar("Shared")


def once_a_table(make: Callable[[Table], Shared]) -> Callable[[Table], Shared]:
    """Let all BSDFs of a table share the result of a function, in each variant's memory."""
    made: weakref.WeakKeyDictionary[Any, dict[str, Shared]] = weakref.WeakKeyDictionary()

    @functools.wraps(make)
    def shared(table: Table) -> Shared:
        variants = made.setdefault(table, {})
        if mi.variant() not in variants:
            variants[mi.variant()] = make(table)
        return variants[mi.variant()]

    return shared


def upload(kind: Kind, values: NDArray[np.generic]) -> Buffer:
    """Upload an array into memory of Dr.Jit's own, which starts at a cache line.

    On the CPU an array made from NumPy's may go on using NumPy's memory: aligned by chance, and
    mistaken for other arrays when a function recorded by `dr.freeze` runs again. Scalar variants
    have no such arrays: there it stays NumPy's, in single precision for want of `mi.Float16`.
    """
    if not dr.is_jit_v(mi.Float):
        return values.astype(np.float32 if kind is mi.Float16 else values.dtype).ravel()
    array = kind(values.ravel()) * dr.opaque(kind, 1)
    dr.eval(array)
    return array


def read(kind: Kind, source: Buffer, index: Index, active: Mask = True) -> Float | Index:
    """Gather a number per lane; 0 in inactive lanes."""
    if not dr.is_jit_v(mi.Float):
        return kind(source[index] if active else 0)
    return dr.gather(kind, source, index, active)


def float_of_bits(bits: Index) -> Float:
    """The number of single precision that has these bits."""
    if not dr.is_jit_v(mi.Float):
        return float(np.uint32(bits).view(np.float32))
    return dr.reinterpret_array(mi.Float, bits)


def read_packets(source: Buffer, index: Index, floats: int, active: Mask = True) -> list[Packet]:
    """Gather the record with this index, of so many floats, in the largest packets that fit.

    Inactive lanes get zeros, and read no memory.
    """
    if not dr.is_jit_v(mi.Float):
        return [
            mi.ArrayXf(source[index * floats : (index + 1) * floats] if active else [0.0] * floats)
        ]
    size = packet_size(floats)
    count = floats // size
    kind = mi.ArrayXf16 if dr.type_v(source) is dr.VarType.Float16 else mi.ArrayXf
    return [
        mi.ArrayXf(
            dr.gather(kind, source, index * count + n, active, shape=(size, dr.width(index)))
        )
        for n in range(count)
    ]


def zero_packets(floats: int) -> list[Packet]:
    """Return the packets of `read_packets` with zeros in them."""
    if not dr.is_jit_v(mi.Float):
        return [mi.ArrayXf([0.0] * floats)]
    size = packet_size(floats)
    return [dr.zeros(mi.ArrayXf, (size, 1)) for _ in range(floats // size)]


def read_record(source: Buffer, index: Index, floats: int, active: Mask = True) -> list[Float]:
    """Gather the floats of the record with this index; see `read_packets`."""
    return [x for packet in read_packets(source, index, floats, active) for x in packet]


def packet_size(floats: int) -> int:
    """The largest power of two that divides a record, at most `PACKET`."""
    return min(PACKET, floats & -floats)


def index_between(value: Float, low: float, high: float) -> Float:
    """The value clipped to an index's range; NaN, as from a degenerate mesh, becomes `low`.

    `dr.clip` would keep the NaN, whose integer would read far outside the table.
    """
    value = dr.select(value > low, value, low)
    return dr.select(value < high, value, high)
