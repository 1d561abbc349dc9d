"""Formulas of optics in GLSL, one by one, against `md.reference` in double precision."""

from __future__ import annotations

from typing import Any

import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.optics.boundary import MODELS, Model
from mitsuba_diffraction.realtime.glsl.formulas import formulas
from tests.support.formulas import INDICES, check, exact_power, pairs
from tests.support.languages import shaded

PAIRS = pairs(4000)


@pytest.mark.parametrize("coated", [False, True], ids=["bare", "coated"])
@pytest.mark.parametrize("kind", INDICES)
@pytest.mark.parametrize("name", MODELS)
def test_boundary_is_that_of_the_reference(gl: Any, name: str, kind: str, coated: bool) -> None:
    index = INDICES[kind]
    found = shaded(gl, PAIRS, MODELS[name], index, coated)
    check(found, exact_power(PAIRS, index, coated=coated, name=name))


def test_model_that_branches_on_values_is_refused(monkeypatch: Any) -> None:
    def branching(geometry: Any, index: Any, heights: Any) -> Any:
        return boundary.kirchhoff(geometry, index if heights.kappa > 1.0 else 1.0 * index)

    monkeypatch.setitem(MODELS, "branching", Model("branching", branching))
    with pytest.raises(DiffractionError, match=r"test_formulas.py, line \d+.*branches on a value"):
        formulas({"BOUNDARY": "branching", "SURFACE_KIND": "1"})
