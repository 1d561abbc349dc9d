"""Reports of nested plain data, for people and as JSON."""

from __future__ import annotations

import json
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction.cli.report import lines_of, plain

leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
data = st.recursive(
    leaves, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8
)


@settings(max_examples=30)
@given(st.dictionaries(st.text(), data))
def test_any_data_prints_without_stray_line_ends(content):
    for line in lines_of(content):
        assert len(line.splitlines()) <= 1


@settings(max_examples=30)
@given(data)
def test_any_data_is_strict_json(content):
    json.loads(json.dumps(plain(content), allow_nan=False))


def test_numbers_of_arrays_are_plain():
    assert plain(np.arange(2)) == [0, 1]
    assert plain({"a": np.float32(0.5), "b": (np.int64(2), math.inf)}) == {"a": 0.5, "b": [2, None]}


def test_units_and_nesting_read_well():
    content = {
        "kind": "table",
        "wavelength_range_nm": [360.0, 830.0],
        "error": {"near": 1.2345678e-4, "met": True},
        "extent": [65.0, 32.5],
        "history": ["levelled", "clipped"],
        "patches": [{"range": 0.25, "history": []}],
        "options": {},
    }
    assert list(lines_of(content)) == [
        "kind:             table",
        "wavelength range: 360 to 830 nm",
        "error:",
        "  near: 0.0001235",
        "  met:  yes",
        "extent:           65 x 32.5 µm",
        "history:",
        "  - levelled",
        "  - clipped",
        "patches:",
        "  - range:   0.25 µm",
        "    history: none",
        "options:          none",
    ]
