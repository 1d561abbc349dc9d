"""Periods of patches: found, refused with the confidence, or given."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import estimate_periods
from tests.directions import rough_patch
from tests.thesis.methods.conftest import WIDTH


@settings(max_examples=20)
@given(st.floats(0.5, 5.0), st.sampled_from(["x", "y"]))
def test_the_period_of_a_grating_is_found(length, axis):
    patch = gratings.blazed(length, 0.2, periods=6, axis=axis)
    x, y = estimate_periods(patch)
    found, other = (x, y) if axis == "x" else (y, x)
    assert found.length == pytest.approx(length, rel=1e-3)
    assert found.confidence == pytest.approx(1.0, abs=1e-6)
    assert not other.found


def test_a_snake_s_scale_has_a_period_across_its_fingers_only():
    x, y = estimate_periods(gratings.elaphe_like(32.0, 512))
    assert x.found
    assert 0.9 < x.length < 1.2  # what it is made with (gratings.scales), some 1 µm
    assert not y.found


@pytest.mark.parametrize("name", ["nmm", "rainbow"])
def test_a_patch_without_a_period_is_refused_with_the_confidence(name):
    rough = rough_patch((128, 128), (0.1, 0.1), 0.2, seed=7)
    with pytest.raises(DiffractionError, match=r"needs a period.*confidence 0\.\d.*give period"):
        methods.make(name, rough, coherence_width=WIDTH)


def test_a_given_period_serves_instead(rough):
    method = methods.make("nmm", rough, coherence_width=WIDTH, period=1.5)
    assert 1.5 in method.periods
