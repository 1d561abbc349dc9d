"""Features that go together: each choice refuses what it does not support, and nothing else."""

from __future__ import annotations

from dataclasses import fields

import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.plugin import support
from mitsuba_diffraction.plugin.support import Support, check_combination, supported

DECLARED = [value for value in vars(support).values() if isinstance(value, Support)]
FEATURES = [field.name for field in fields(Support) if field.name != "choice"]


@pytest.mark.parametrize("declared", DECLARED, ids=lambda one: one.choice)
def test_a_choice_refuses_the_features_that_it_lacks_and_no_others(declared):
    choices = [Support("another choice"), declared]
    for feature in FEATURES:
        assert supported(feature, choices) == getattr(declared, feature)
        if getattr(declared, feature):
            check_combination({feature: "the feature"}, choices)
            continue
        with pytest.raises(DiffractionError) as caught:
            check_combination({feature: "the feature"}, choices)
        assert "the feature" in str(caught.value)
        assert declared.choice in str(caught.value)
    assert not all(getattr(declared, feature) for feature in FEATURES)
