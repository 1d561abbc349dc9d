"""Compact arrays, meshes and tables, undone as the page does it."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from mitsuba_diffraction.realtime.glsl.scene import VERTEX
from mitsuba_diffraction.realtime.web.sections import (
    Sections,
    packed_array,
    packed_mesh,
)
from mitsuba_diffraction.realtime.web.tables import rounded

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


def test_the_smaller_layout_is_chosen() -> None:
    ramp = np.arange(3000, dtype=np.uint32)[:, None] * 7919
    assert packed_array(ramp).layout["differences"]
    noise = np.random.default_rng(1).integers(0, 2**32, (3000, 1), np.uint32)
    assert not packed_array(noise).layout["differences"]


@pytest.mark.parametrize("flat", [True, False])
def test_triangles_come_back_within_sixteen_bits(flat: bool) -> None:
    rng = np.random.default_rng(2)
    corners = rng.integers(0, 40, (100, 3))
    per_vertex = rng.normal(size=(40, 17)).astype(np.float32)
    per_vertex[:, 11:14] = [0.2, 0.4, 0.6]  # one colour
    vertices = per_vertex[corners.ravel()]
    if flat:
        vertices[:, 6:9] = np.repeat(rng.normal(size=(100, 3)), 3, axis=0)
    sections = Sections()
    mesh = packed_mesh(vertices, sections)
    data, layouts = sections.joined()

    def stored(name: str) -> NDArray[Any]:
        layout = layouts[mesh[name]]
        numbers = undone(data[layout["start"] : layout["start"] + layout["length"]], layout)
        return numbers.reshape(-1, {"columns": mesh["width"], "corners": 1, "tangents": 3}[name])

    assert len(stored("columns")) == len(np.unique(corners))
    assert (mesh["tangents"] is not None) == flat
    rows = stored("columns")[stored("corners")[:, 0]]
    start = 0
    for name, size in VERTEX:
        expected = vertices[:, start : start + size]
        start += size
        if name in ("normal", "tangent"):
            expected = expected / np.linalg.norm(expected, axis=1, keepdims=True)
        if "value" in mesh["layout"][name]:
            assert name == "colour"
            value = mesh["layout"][name]["value"]
            np.testing.assert_allclose(np.tile(value, (300, 1)), expected)
        else:
            place = mesh["layout"][name]
            if name == "tangent" and flat:
                whole = np.repeat(stored("tangents"), 3, axis=0)
            else:
                whole = rows[:, place["column"] : place["column"] + size]
            found = place["low"] + np.array(place["step"]) * whole
            assert (np.abs(found - expected) <= 0.51 * np.array(place["step"])).all()


@given(st.integers(4, 8), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 2.0**-12]))
def test_rounding_is_bounded_by_the_largest_number_of_a_row(
    bits: int, seed: int, floor: float
) -> None:
    values = (
        np.random.default_rng(seed).normal(size=(20, 8))
        * 10.0 ** np.arange(-3.0, 2.0, 0.25)[:, None]
    )
    found = rounded(values, bits, floor).astype(float)
    largest = np.abs(values).max(axis=1, keepdims=True)
    # half a step of 2^(1 - bits) of the largest; half floats hold the result exactly to 10 bits
    bounds = np.maximum(largest * 2.0**-bits, largest.max() * floor)
    assert (np.abs(found - values) <= bounds * 1.001).all()
    np.testing.assert_array_equal(rounded(found, bits, floor), found)
