"""The boundary models: one list of names, and refusals of any other."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from mitsuba_diffraction.optics import boundary, through
from mitsuba_diffraction.optics.blend import RoughnessTable
from mitsuba_diffraction.optics.paths import Path
from mitsuba_diffraction.tables.energy.conserved import Transmitter
from mitsuba_diffraction.tables.energy.gain import PathGain
from tests.support.directions import polar

FLAT = md.HeightField(np.zeros((4, 4)), 0.2)
UP, DOWN = polar(20), polar(30) * [1, 1, -1]
CALLS = {
    "brdf": lambda name: reference.brdf(FLAT, UP, UP, 520.0, eta=1.5, model=name),
    "film": lambda name: reference.brdf(
        FLAT, UP, UP, 520.0, eta=1.5, film=(1.3, 200.0), model=name
    ),
    "btdf": lambda name: reference.btdf(FLAT, UP, DOWN, 520.0, eta=1.5, model=name),
    "model": lambda name: boundary.model_of(name),
    "gain": lambda name: PathGain(
        Path(1.5, name), RoughnessTable(0.0, np.zeros(2)), 12.0, 1.0
    ).exact(np.array(0.5), np.array(0.5), 0.0),
    "dielectric": lambda name: Transmitter(1.5, name, thin=False).paths(np.ones(1), 0.1),
}


def test_models_of_light_that_goes_through_are_models_of_reflected_light():
    assert set(through.MODELS) <= set(boundary.MODELS)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_an_unknown_model_is_refused_with_the_choices(call):
    with pytest.raises(md.DiffractionError, match=r"model='rice'.*small_slope, kirchhoff"):
        call("rice")
    call("kirchhoff")
