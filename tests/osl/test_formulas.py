"""Formulas of optics in OSL, one by one, against `md.reference` in double precision."""

from __future__ import annotations

from mitsuba_diffraction.optics.boundary import MODELS
from tests.support.blender import blender
from tests.support.formulas import INDICES, check, exact_power, pairs
from tests.support.languages import emitted

PAIRS = pairs(64**2)


def test_boundary_is_that_of_the_reference(tmp_path):
    blender()
    indices, model = list(INDICES.values()), MODELS["small_slope"]
    for index, found in zip(indices, emitted(tmp_path, PAIRS, model, indices), strict=True):
        check(found, exact_power(PAIRS, index))
