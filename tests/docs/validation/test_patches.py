"""Surfaces in two dimensions: their cells, the kept solutions, and the model beside them."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import rayleigh
from docs.make.validation.cases import Case, Grating, Light, Media
from docs.make.validation.compare import Comparison, Sides
from docs.make.validation.models import by_model, of_cells
from docs.make.validation.patches import CELLS
from docs.make.validation.solutions import shipped
from mitsuba_diffraction.reference import model

pytestmark = pytest.mark.thorough


KERATIN = shipped("keratin", "patches_rayleigh")
#: Light at 35.7° from between the axes.
SLANTED = Light(550.0, float(np.degrees(np.arcsin(np.hypot(0.5, 0.3)))), 31.0)


@pytest.fixture(scope="module")
def keratin() -> Sides:
    return by_model(KERATIN)


def test_cuts_of_scales_meet_the_goal_on_average(keratin):
    cuts = of_cells(keratin["small_slope"], kind=["elaphe", "elaphe_like"], slope=0.2)
    assert len(cuts) >= 6
    assert np.mean(cuts) < 0.07
    # the goal for each, 10 %, is missed by one, where light is diffracted twice
    assert sorted(cuts)[-2] < 0.10


def deviation(part: Comparison, light: str | None = None) -> float:
    return part.deviation(colours=True, light=light)


def test_sinusoids_in_any_mount_and_crossed_gratings_are_nearly_exact(keratin):
    parts = (keratin[name].each() for name in ("small_slope", "kirchhoff"))
    for new, old in zip(*parts, strict=True):
        case = new.solved[0].case
        if case.surface.kind in ("sinusoid", "crossed"):
            assert deviation(new) < 0.03, case
            # or worse by little, where both are as good as exact
            assert deviation(new) < deviation(old) + 5e-4, case
            for light in ("te", "tm"):
                assert deviation(new, light) < deviation(old, light), case


def test_cross_polarised_light_has_the_sign_and_size_of_coupled_waves():
    checked = 0
    for solution in KERATIN.where(surface=CELLS["sinusoid 2.5/0.05 µm"]).solved:
        matrix = model.small_slope(solution.case.wi, solution.wo, 1.56)
        for truth, mine, number in zip(solution.jones, matrix, solution.order[:, 0], strict=True):
            if abs(number) == 1:
                # relative to s in, s out: phases of the height's zero are no matter
                assert mine / mine[0, 0] == pytest.approx(truth / truth[0, 0], abs=0.01)
                checked += abs(mine[1, 0] / mine[0, 0]) > 0.1
    assert checked >= 4


def test_rayleigh_s_expansion_agrees_with_the_integral_method_on_aluminium():
    truth = shipped("aluminium").where(profile="sinusoidal", theta=60.0, wavelength=460.0)
    for period, depth, allowed in ((2.5, 0.1, 5e-5), (1.1, 0.1, 5e-5), (2.5, 0.2, 5e-4)):
        (solved,) = truth.where(grating=Grating("sinusoidal", period, depth)).solved
        found = rayleigh.solve(solved.case, 41)
        by_order = dict(zip(found.order[:, 0].tolist(), found.powers, strict=True))
        mine = np.array([by_order[m] for m in solved.order[:, 0].tolist()])
        assert mine == pytest.approx(solved.powers, abs=allowed)


def test_it_is_reciprocal_between_any_planes():
    case = Case(CELLS["crossed grating"], SLANTED, Media("aluminium"))
    there = rayleigh.solve(case, 165)
    wo = case.wo(there.order)
    signs = np.array([[1.0, -1.0], [-1.0, 1.0]])  # reversed light has the other p
    for n in np.flatnonzero(wo[:, 2] > 0.5)[:6]:
        x, y, z = wo[n]
        turned = Light(550.0, float(np.degrees(np.arccos(z))), float(np.degrees(np.arctan2(y, x))))
        reverse = Case(case.surface, turned, case.media)
        back = rayleigh.solve(reverse, 165)
        same = (back.order == there.order[n]).all(axis=1).argmax()
        assert reverse.wo(back.order)[same] == pytest.approx(case.wi, abs=1e-9)
        ratio = case.wi[2] / z
        assert back.jones[same].T * signs * ratio == pytest.approx(there.jones[n], abs=1e-5)


@pytest.mark.parametrize(("name", "allowed"), [("crossed grating", 1e-6), ("CD's pits, low", 1e-3)])
def test_what_is_reflected_and_what_goes_through_add_up(name, allowed):
    back, through = (
        rayleigh.solve(Case(CELLS[name], SLANTED, Media("keratin", through=side)), 317)
        .powers.mean(axis=1)
        .sum()
        for side in (False, True)
    )
    assert 0.9 < through < 0.97
    assert back + through == pytest.approx(1.0, abs=allowed)
