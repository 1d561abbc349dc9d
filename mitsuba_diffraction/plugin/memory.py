"""Upload arrays to the variant's device and gather from them.

Hides the difference between JIT and scalar variants.
"""

from __future__ import annotations

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
#: Bytes of the processors' longest vectors.
_VECTOR = 64

Table = TypeVar("Table")
Shared = TypeVar("Shared")


def once_a_table(make: Callable[[Table], Shared]) -> Callable[[Table], Shared]:
    """Let all BSDFs of a table share one object that is made of the table, in each variant."""
    made: weakref.WeakKeyDictionary[Any, dict[str, Shared]] = weakref.WeakKeyDictionary()

    def shared(table: Table) -> Shared:
        variants = made.setdefault(table, {})
        if mi.variant() not in variants:
            variants[mi.variant()] = make(table)
        return variants[mi.variant()]

    return shared


def upload(kind: Kind, values: NDArray[np.generic]) -> Buffer:
    """Upload an array into memory of Dr.Jit's own, which starts at a cache line.

    On the CPU an array made from NumPy's may go on using NumPy's memory: aligned by chance, read
    beyond its end by kernels of 16 lanes, and mistaken for other arrays when a function recorded by
    `dr.freeze` runs again. Scalar variants have no such arrays: there it stays NumPy's, in single
    precision for want of `mi.Float16`.
    """
    if not dr.is_jit_v(mi.Float):
        return values.astype(np.float32 if kind is mi.Float16 else values.dtype).ravel()
    array = kind(_within(values)) * dr.opaque(kind, 1)
    dr.eval(array)
    return array


def tensor(values: NDArray[np.generic]) -> Any:
    """A `mi.TensorXf` of an array, that may stay in NumPy's memory."""
    return mi.TensorXf(_within(values.astype(np.float32)).reshape(values.shape))


def _within(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """A copy (n,) in a larger piece of memory: a whole vector of the processor can be read at its
    end, as Dr.Jit 1.5 does on the CPU with NumPy's memory.
    """
    larger = np.zeros(values.size + _VECTOR // values.itemsize, values.dtype)
    larger[: values.size] = values.ravel()
    return larger[: values.size]


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
    shape = size, dr.width(index)
    return [
        mi.ArrayXf(dr.gather(kind, source, index * count + n, active, shape=shape))
        for n in range(count)
    ]


def read_record(source: Buffer, index: Index, floats: int) -> list[Float]:
    """Gather the floats of the record with this index; see `read_packets`."""
    return [x for packet in read_packets(source, index, floats) for x in packet]


def packet_size(floats: int) -> int:
    """The largest power of two that divides a record, at most `PACKET`."""
    return min(PACKET, floats & -floats)


class HalfFloats:
    """Records of half floats in the variant's memory, which are read as 32-bit words.

    Words take fewer instructions than half floats: fewer to transpose, and no conversion. Exponent
    and mantissa are moved to where single precision has them, and there stand for 2⁻¹¹² times the
    number. Half floats below 2⁻¹⁴ are 0: they would be subnormal in single precision, too, and
    slow. Scalar variants keep single precision.

    Attributes
    ----------
    numbers : in a record, filled up with a zero to whole words.
    scale : factor from the numbers that `read` returns to the records', 2¹¹².
    """

    def __init__(self, records: NDArray[Any]) -> None:
        self.numbers = records.shape[1] + records.shape[1] % 2
        halves = np.zeros((len(records), self.numbers), np.float16)
        halves[:, : records.shape[1]] = records
        self._size = min(packet_size(self.numbers // 2), PACKET // 2)
        self.scale = 2.0**112 if dr.is_jit_v(mi.Float) else 1.0
        if not dr.is_jit_v(mi.Float):
            self._words: Buffer = halves.astype(np.float32).ravel()
            return
        bits = halves.view(np.uint16)
        bits *= (bits & 0x7C00) != 0
        # a packet of words holds so many numbers in its lower halves, the next in its upper
        lower, upper = np.moveaxis(bits.reshape(-1, 2, self._size), 1, 0)
        self._words = upload(mi.Int32, np.stack([lower, upper], axis=-1).view(np.int32))

    def words(self, index: Index, active: Mask = True) -> list[Packet]:
        """Gather the words of the record with this index, in packets."""
        count, shape = self.numbers // (2 * self._size), (self._size, dr.width(index))
        return [
            dr.gather(mi.ArrayXi, self._words, index * count + n, active, shape=shape)
            for n in range(count)
        ]

    def read(self, index: Index, active: Mask = True) -> list[Packet]:
        """Gather the record with this index, over `scale`, in packets; zeros in inactive lanes."""
        if not dr.is_jit_v(mi.Float):
            return read_packets(self._words, index, self.numbers, active)
        packets = []
        for words in self.words(index, active):
            # an arithmetic shift copies the sign to the three bits before the exponent
            lower, upper = (words << 16) >> 3, words >> 3
            for bits, mask in ((lower, ~0x70000000), (upper, ~0x70001FFF)):
                packets.append(dr.reinterpret_array(mi.ArrayXf, bits & mask))
        return packets


def index_between(value: Float, low: float, high: float) -> Float:
    """The value clipped to an index's range; NaN, as from a degenerate mesh, becomes `low`.

    `dr.clip` would keep the NaN, whose integer would read far outside the table.
    """
    value = dr.select(value > low, value, low)
    return dr.select(value < high, value, high)
