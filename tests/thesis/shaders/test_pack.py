"""Tables of the thesis' methods for the shaders are kept between processes."""

from __future__ import annotations

import gc
import weakref

import numpy as np

from mitsuba_diffraction import DiffractionTable, gratings
from mitsuba_diffraction.thesis.shaders.pack import thesis_method


def test_tables_are_built_once(monkeypatch, tmp_path):
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path))
    blazed = gratings.blazed(period=2.0, depth=0.2, periods=4)
    table = DiffractionTable.build(blazed, coherence_width=8.0)
    first = thesis_method("flss", blazed, table)
    expected, in_memory = first.table.coefficients.copy(), weakref.ref(first.table)
    (file,) = tmp_path.glob("*.cache")
    written = file.stat().st_ino  # another one of a file that is written again
    del first
    gc.collect()
    assert in_memory() is None  # as in the next process
    second = thesis_method("flss", blazed, table)
    np.testing.assert_array_equal(second.table.coefficients, expected)
    assert file.stat().st_ino == written
    thesis_method("pq", blazed, table)
    assert len([*tmp_path.glob("*.cache")]) == 2
