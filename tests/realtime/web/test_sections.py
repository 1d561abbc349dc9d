"""Compact arrays, meshes and tables, undone as the page does it."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from mitsuba_diffraction.realtime.web.sections import (
    packed_array,
)

KINDS = {
    "Uint8Array": np.uint8, "Int16Array": np.int16, "Uint16Array": np.uint16,
    "Uint32Array": np.uint32, "Float32Array": np.float32,
}  # fmt: skip


def undone(data: bytes, layout: dict[str, Any]) -> NDArray[Any]:
    """What `restored` of data.js does."""
    kind = np.dtype(KINDS[layout["kind"]])
    planes = np.frombuffer(zlib.decompress(data), np.uint8)
    planes = planes.reshape(layout["columns"] * kind.itemsize, -1)
    bits = np.ascontiguousarray(planes.T).view(f"u{kind.itemsize}")
    bits = np.cumsum(bits, axis=0, dtype=bits.dtype) if layout["differences"] else bits
    return bits.view(kind).ravel()


STORED = [*KINDS.values(), np.float16]


@given(arrays.arrays(st.sampled_from(STORED), st.tuples(*[st.integers(1, 9)] * 2)))
def test_arrays_come_back_as_they_were(values: NDArray[Any]) -> None:
    section = packed_array(values)
    # half floats are stored as their bits
    expected = values.view(np.uint16) if values.dtype == np.float16 else values
    np.testing.assert_array_equal(undone(section.data, section.layout), expected.ravel())
