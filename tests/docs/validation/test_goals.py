"""What was asked of the default model beside Kirchhoff's: goals, and what misses them."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import goals
from docs.make.validation.cases import Grating, index_of
from docs.make.validation.compare import Sides
from docs.make.validation.models import ANGLES, BOTH, COMPARED, banded, by_model
from docs.make.validation.solutions import Solutions, shipped
from mitsuba_diffraction.reference import boundary, model

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def keratin() -> Sides:
    return by_model(shipped("keratin"))


@pytest.fixture(scope="module")
def aluminium() -> Sides:
    return by_model(shipped("aluminium"), COMPARED)


@pytest.fixture(scope="module")
def cases(aluminium) -> list[goals.Selection]:
    return goals.singles(goals.with_half(aluminium))


def test_on_keratin_in_oblique_light_goals_are_met(keratin):
    reached = goals.keratin_goals(keratin)
    assert len(reached) == len(goals.KERATIN)
    for goal in reached:
        assert 0 < goal.default <= goal.goal < goal.kirchhoff


def test_on_keratin_nothing_is_worse_than_kirchhoff_by_more_than_a_tenth(keratin):
    assert goals.much_worse(keratin) == []


def test_on_aluminium_few_gratings_are_worse_and_by_little(cases):
    assert len(cases) > 130
    gains = np.array([case.gain for case in cases])
    change = np.array([case.change for case in cases])
    assert np.sum(gains > change) > 5 * np.sum(gains < -change)
    # Kirchhoff's errors cancel there; the table says where, and what other shares would leave
    assert gains.min() > -0.0085
    assert gains.max() > 0.05
    assert gains.mean() > 0.005


def test_on_aluminium_it_is_no_worse_in_any_band(aluminium):
    old, new = (list(banded(aluminium[name])) for name in BOTH)
    for (name, band, before), (_, _, after) in zip(old, new, strict=True):
        for theta, was, now in zip(ANGLES, before, after, strict=True):
            # Kirchhoff's errors of the two polarisations cancel: blazed 1.1/0.1 µm at 30° has 47 %
            # of the mean, 54 and 68 % of either; and where both are as good as exact
            assert now <= max(1.01 * was, was + 5e-5), (name, band, theta)
    assert new[0][2][2] < 0.3 * old[0][2][2]  # gentle sinusoids at 60°


def test_on_aluminium_either_polarisation_is_far_better(aluminium):
    chosen = {"profile": "sinusoidal", "period": 2.5, "theta": 60.0, "wavelength": 610.0}
    old, new = (aluminium[name].where(**chosen) for name in BOTH)
    for depth in (0.05, 0.1, 0.2):
        for light in ("te", "tm"):
            before, after = (
                part.where(depth=depth).deviation(colours=True, light=light) for part in (old, new)
            )
            assert after < 0.4 * before, depth


def test_shares_lie_between_the_two_matrices():
    (solved,) = (
        shipped("aluminium")
        .where(grating=Grating("blazed", 1.1, 0.1), theta=30.0, wavelength=460.0)
        .solved
    )
    models = goals.with_half(by_model(Solutions([solved]), COMPARED))
    lit = solved.case.wi, solved.wo, index_of("aluminium", 460.0)
    direct = models["kirchhoff"].model * boundary.unpolarised(model.blended(*lit, 0.25))
    direct /= boundary.unpolarised(model.kirchhoff(*lit))
    assert goals._by_share(models)[25] == pytest.approx(direct, rel=1e-9)


def test_no_blend_does_better_than_the_bounds(cases):
    for case in cases[::7]:
        (share, best), bound = case.with_one_share(), case.with_any_shares()
        assert 0 <= share <= 1
        assert bound <= best <= min(map(case.deviation, ("kirchhoff", "small_slope_alone")))
        # between the hundredths that shares have
        assert bound <= case.deviation("small_slope") + 1e-4
