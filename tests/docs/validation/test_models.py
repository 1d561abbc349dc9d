"""The small-slope model against rigorous solutions, beside Kirchhoff's."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation.cases import PROFILES
from docs.make.validation.compare import Comparison, angles_of, compare, gratings_of, table_of
from docs.make.validation.models import banded, of_colours
from docs.make.validation.solutions import shipped

#: Largest deviation of colours on keratin at 60°, by profile and depth/period.
GOALS = {
    ("sinusoidal", 0.03): 0.01,
    ("sinusoidal", 0.08): 0.05,
    ("lamellar", 0.03): 0.04,
    ("lamellar", 0.08): 0.22,
    ("blazed", 0.03): 0.09,
    ("blazed", 0.08): 0.18,
}


@pytest.fixture(scope="module")
def keratin() -> Comparison:
    return compare("keratin", model="small_slope")


def test_on_keratin_in_oblique_light_it_meets_the_goals(keratin):
    found = {(name, high): values[0] for name, (_, high), values in banded(keratin, [60.0])}
    for case, goal in GOALS.items():
        assert 0 < found[case] <= goal, case


def test_nowhere_on_keratin_is_it_worse_than_kirchhoff_by_more_than_a_tenth(keratin):
    kirchhoff = compare("keratin", keratin.solutions)
    for profile in PROFILES:
        chosen, angles = gratings_of(keratin, profile), angles_of(keratin)
        new, old = (table_of(part, chosen, angles, of_colours) for part in (keratin, kirchhoff))
        # or than a twentieth of a per cent, where both are as good as exact
        worse = new > np.maximum(1.1 * old, old + 5e-4)
        assert not worse.any(), [(str(chosen[i]), angles[j]) for i, j in np.argwhere(worse)]


def test_on_gentle_aluminium_it_is_no_worse():
    solutions = shipped("aluminium").where(profile="sinusoidal", theta=60.0)
    old, new = (
        next(banded(compare("aluminium", solutions, model), [60.0]))[2][0]
        for model in ("kirchhoff", "small_slope")
    )
    assert new < 0.5 * old
