"""Spectra of tissue against the reference over the acceptance."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from tests.analysis.acceptance import spectra_and_reference

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("name", ["melanin", "wet keratin", "keratin under water"])
def test_spectra_of_tissue_are_the_reference_s_over_the_acceptance(name):
    mi.set_variant("llvm_ad_spectral")
    # 1 %: the table's tolerance, and 400 directions of the cone
    found, expected = spectra_and_reference(name, np.array([420.0, 660.0]))
    assert found == pytest.approx(expected, rel=0.01)
