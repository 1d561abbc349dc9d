"""Arrays in little space: byte planes, differences, and zlib, as `data.js` reads them."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_LEVEL = 6
_NAMES = {
    np.dtype(np.uint8): "Uint8Array",
    np.dtype(np.int16): "Int16Array",
    np.dtype(np.uint16): "Uint16Array",
    np.dtype(np.uint32): "Uint32Array",
    np.dtype(np.float32): "Float32Array",
    np.dtype(np.float16): "Uint16Array",  # JavaScript has no half floats; WebGL takes their bits
}


@dataclass(frozen=True)
class Section:
    """One array or file in the page's data.

    Attributes
    ----------
    data : bytes as they are stored.
    layout : what the page must know to undo it, as JSON.
    """

    data: bytes
    layout: dict[str, Any]


def packed_array(values: NDArray[Any], *, differences: bool = False) -> Section:
    """An array (rows, columns), compressed without loss.

    All first bytes of a column lie together, then all second ones: alike bytes compress well.

    Parameters
    ----------
    values : of any type that JavaScript has an array of, or half floats.
    differences : store whole numbers less those of the row before, where rows are alike.
    """
    rows, columns = values.shape
    kind = _NAMES[values.dtype]
    size = values.dtype.itemsize
    if differences:
        # whole numbers of fixed size wrap around, here and in the page
        values = np.concatenate([values[:1], values[1:] - values[:-1]])
    contiguous = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    planes = contiguous.view(np.uint8).reshape(rows, columns * size).T
    data = zlib.compress(np.ascontiguousarray(planes).data, _LEVEL)
    layout = {"kind": kind, "rows": rows, "columns": columns, "differences": differences}
    return Section(data, layout)


def packed_file(data: bytes) -> Section:
    """A file of a format that browsers read, as it is."""
    return Section(data, {"kind": "file"})


class Sections:
    """The page's data, one section after another."""

    def __init__(self) -> None:
        self._parts: list[Section] = []

    def add(self, section: Section) -> int:
        """Append a section and return its number."""
        self._parts.append(section)
        return len(self._parts) - 1

    @property
    def nbytes(self) -> int:
        """Bytes so far."""
        return sum(len(part.data) for part in self._parts)

    def joined(self) -> tuple[bytes, list[dict[str, Any]]]:
        """All bytes, and where and how each section lies in them."""
        layouts, start = [], 0
        for part in self._parts:
            layouts.append({**part.layout, "start": start, "length": len(part.data)})
            start += len(part.data)
        return b"".join(part.data for part in self._parts), layouts
