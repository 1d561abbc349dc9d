"""The thesis' look-up, an image a term, beside the plugin's; tables kept between processes."""

from __future__ import annotations

import gc
import weakref

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionTable, gratings
from mitsuba_diffraction.thesis.shaders.pack import thesis_method
from mitsuba_diffraction.thesis.term_images import thesis_bsdf
from tests.support.directions import polar, rough_patch
from tests.support.lanes import evaluated


def test_images_of_terms_have_the_plugin_s_values():
    mi.set_variant("llvm_ad_spectral")
    settings = {"coherence_width": 3.0, "coherence": "patch", "basis": "taylor", "tolerance": 0.9}
    table = md.DiffractionTable.build(
        rough_patch((32, 32), (0.1, 0.1), 0.08), terms=12, taps=3, **settings
    )
    ours, theirs = mi.load_dict(md.bsdf_dict(table)), thesis_bsdf(table)
    wo = [polar(theta, phi) for theta in (15, 40) for phi in range(0, 360, 45)]
    expected = evaluated(ours, polar(20), wo, 550.0)
    # sums of 12 terms in single precision, of which the largest is 10 times the sum
    assert evaluated(theirs, polar(20), wo, 550.0) == pytest.approx(
        expected, rel=1e-3, abs=1e-4 * expected.max()
    )


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
