"""Formulas of optics in OSL, one by one, against `md.reference` in double precision."""

from __future__ import annotations

import pytest

from mitsuba_diffraction.optics.boundary import MODELS
from tests.support.blender import blender
from tests.support.formulas import FADED, INDICES, check, exact_faded, exact_power, pairs
from tests.support.languages import emitted

PAIRS = pairs(64**2)


@pytest.mark.parametrize(
    ("model", "exact"),
    [(MODELS["small_slope"], exact_power), (FADED, exact_faded)],
    ids=["small slope", "of the heights"],
)
def test_boundary_is_that_of_the_reference(model, exact, tmp_path):
    blender()
    indices = list(INDICES.values())
    for index, found in zip(indices, emitted(tmp_path, PAIRS, model, indices), strict=True):
        check(found, exact(PAIRS, index))
