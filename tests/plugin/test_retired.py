"""Parameters of earlier versions: scenes that name one go on, and are told what holds instead."""

from __future__ import annotations

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.retired import REPLACED
from tests.support.patches import DEFAULTS, PATCH


# the patch is narrower than its window
@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
@pytest.mark.parametrize("plugin", ["diffraction", "diffraction_dielectric"])
@pytest.mark.parametrize(
    ("name", "value"), [("second_order", True), ("layering", "thesis"), ("diffuse_weight", 0.3)]
)
def test_a_retired_parameter_changes_nothing_but_is_named(some_variant, plugin, name, value):
    plain = md.bsdf_dict(PATCH, plugin, **DEFAULTS)
    with pytest.warns(md.DiffractionWarning) as heard:
        bsdf = mi.load_dict(plain | {name: value})
    assert sum(REPLACED[name] in str(warning.message) for warning in heard) == 1
    assert str(bsdf) == str(mi.load_dict(plain))
