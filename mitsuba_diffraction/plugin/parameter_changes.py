"""What changes between renderings: bounded parameters, and what `dr.freeze` must know of a BSDF.

A frozen function refuses arrays that it was not told of. Of a plugin written in Python, Dr.Jit sees
the attributes: arrays, lists of them and Mitsuba's own objects, but not what plain Python objects
hold. It records anew when their number or their types are others, but not when plain numbers are,
which are part of the recorded kernels: given another patch, it would go on with this one's.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..tables.table import DiffractionTable
from .types import Callback, Float

_OURS = __name__.rpartition(".")[0]


class Bounded:
    """A differentiable number between bounds.

    Parameters
    ----------
    name : for `mi.traverse`.
    value : the first.
    low, high : the least and the largest that are taken.
    refusal : what to say of another one.

    Attributes
    ----------
    high : as given.
    value : mi.Float, the same object ever after: Mitsuba assigns to it.
    """

    def __init__(
        self, name: str, value: float, low: float, high: float, refusal: Callable[[float], str]
    ) -> None:
        self.value: Float = mi.Float(value)
        self.high = high
        self._name, self._low, self._refusal = name, low, refusal
        self._last: Float = mi.Float(value)

    def settle(self) -> str | None:
        """Take the value given, as a variable, so that kernels stay; or say why it is refused."""
        given = np.array(dr.detach(self.value), float).ravel()
        wrong = given[~((given >= self._low) & (given <= self.high))]
        if len(wrong):
            if dr.is_jit_v(self.value):
                mi.set_property(self.value, self._last)
            return self._refusal(float(wrong[0]))
        dr.make_opaque(self.value)
        self._last = mi.Float(dr.detach(self.value))
        return None

    def traverse(self, callback: Callback) -> None:
        """Expose it."""
        callback.put(self._name, self.value, mi.ParamFlags.Differentiable)


def children(thing: Any) -> dict[str, Any]:
    """The objects that one of Mitsuba's shows to `traverse`, by name."""

    class Collector(mi.TraversalCallback):
        def __init__(self) -> None:
            super().__init__()
            # not in a closure: a class is in a cycle of references, which would keep them
            self.found: dict[str, Any] = {}

        def put(self, name: str, value: Any, *rest: Any) -> None:
            if isinstance(value, mi.Object):
                self.found[name] = value

    collector = Collector()
    thing.traverse(collector)
    return collector.found


def arrays_within(*holders: Any) -> list[Any]:
    """All Dr.Jit arrays and Mitsuba objects that objects of this folder hold, each once.

    They are the very objects, so that what Dr.Jit assigns to them the kernels see.
    """
    found: dict[int, Any] = {}
    for holder in holders:
        for value in _walk(holder, set()):
            found.setdefault(id(value), value)
    return list(found.values())


def marks(table: DiffractionTable, *constants: object) -> list[Any]:
    """Zeros whose types tell apart the kernels of one table and these constants from others'.

    Types, because Dr.Jit compares those, and stops comparing values once they have changed.
    """
    checksum = zlib.crc32(repr((table.digest(), *constants)).encode())
    kinds = (
        mi.Bool, mi.Int32, mi.UInt32, mi.Int64, mi.UInt64, mi.Float16, mi.Float32, mi.Float64,
    )  # fmt: skip
    return [kinds[checksum >> shift & 7](0) for shift in range(0, 33, 3)]


def _walk(value: Any, seen: set[int]) -> Iterator[Any]:
    if id(value) in seen:
        return
    seen.add(id(value))
    if dr.is_array_v(value) or isinstance(value, mi.Object):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _walk(item, seen)
    elif type(value).__module__.startswith(_OURS):
        for item in vars(value).values():
            yield from _walk(item, seen)
