"""Surfaces in two dimensions: their cells, the kept solutions, and the model beside them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from docs.make.validation import crossed, rayleigh
from docs.make.validation.cases import Grating, index_of
from docs.make.validation.cells import PatchComparison, agreements, compared
from docs.make.validation.patch_solutions import SOLVERS, solve_case, solved
from docs.make.validation.patches import (
    SURFACES,
    PatchCase,
    cell,
    measured_cuts,
)
from docs.make.validation.solutions import shipped
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.reference import boundary, fresnel, model

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def keratin() -> list[PatchComparison]:
    return compared("keratin")


@pytest.mark.parametrize("surface", SURFACES.values(), ids=str)
def test_a_cell_has_its_slope_and_no_seam(surface):
    field = cell(surface)
    assert field.heights.mean() == pytest.approx(0, abs=1e-12)
    # its band-limited slope; differences of neighbours see a little less
    assert field.rms_slope == pytest.approx(surface.slope, rel=0.06)
    inside = np.abs(np.diff(field.heights, axis=1)).max()
    assert np.abs(field.heights[:, 0] - field.heights[:, -1]).max() <= 1.5 * inside


def test_the_orders_of_a_kept_solution_carry_what_a_dielectric_reflects():
    for solution in solved("keratin")[0]:
        field = cell(solution.case.surface)
        assert np.all(solution.wo(field)[:, 2] > 0)
        assert 0.03 < solution.efficiency(field).sum() < 0.12  # flat: 0.048 to 0.099


def test_what_is_kept_of_the_measured_scale_is_what_it_gives(shared_afm):
    patch = HeightField.load(shared_afm / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375)
    for name, cut in measured_cuts(patch).items():
        heights = cell(SURFACES[name]).heights
        scaled = (cut.heights - cut.heights.mean()) * np.ptp(heights) / np.ptp(cut.heights)
        assert heights == pytest.approx(scaled, abs=1e-6)  # µm; single precision


def test_cuts_of_scales_meet_the_goal_on_average(keratin):
    cuts = [
        c.by_model["small_slope"]
        for c in keratin
        if c.case.surface.kind in ("elaphe", "elaphe_like") and c.case.surface.slope == 0.2
    ]
    assert len(cuts) >= 6
    assert np.mean(cuts) < 0.07
    # the goal for each, 10 %, is missed by one, where light is diffracted twice
    assert sorted(cuts)[-2] < 0.10


def test_sinusoids_in_any_mount_and_crossed_gratings_are_nearly_exact(keratin):
    for c in keratin:
        if c.case.surface.kind in ("sinusoid", "crossed"):
            assert c.by_model["small_slope"] < 0.03, c.case
            # or worse by little, where both are as good as exact
            assert c.by_model["small_slope"] < c.by_model["kirchhoff"] + 5e-4, c.case
            for new, old in zip(c.polarised["small_slope"], c.polarised["kirchhoff"], strict=True):
                assert new < old, c.case


def test_cross_polarised_light_has_the_sign_and_size_of_coupled_waves():
    checked = 0
    for solution in solved("keratin")[0]:
        if solution.case.surface.name != "sinusoid 2.5/0.05 µm":
            continue
        wo = solution.wo(cell(solution.case.surface))
        matrix = model.small_slope(solution.wi, wo, 1.56)
        for truth, mine, number in zip(
            solution.rows["jones"], matrix, solution.rows["mx"], strict=True
        ):
            if abs(number) == 1:
                # relative to s in, s out: phases of the height's zero are no matter
                assert mine / mine[0, 0] == pytest.approx(truth / truth[0, 0], abs=0.01)
                checked += abs(mine[1, 0] / mine[0, 0]) > 0.1
    assert checked >= 4


@pytest.mark.parametrize("index", [1.56, 1 + 6.5j])
@pytest.mark.parametrize("solver", ["coupled_wave", "rayleigh"])
def test_the_solvers_give_a_mirror_fresnel_s_coefficients(solver, index):
    if solver == "coupled_wave":
        pytest.importorskip("grcwa")
    wi = np.array([0.5, 0.3, np.sqrt(1 - 0.34)])
    field = HeightField(
        1e-9 * np.cos(2 * np.pi * np.arange(16) / 16) * np.ones((2, 1)), (0.1, 0.01)
    )
    module, resolution = SOLVERS[solver], (5, 2)[: 2 if solver == "coupled_wave" else 1]
    found = module.solve(field, index, 550.0, wi, *resolution)
    zeroth = found.jones[(found.order == 0).all(axis=1)][0]
    assert zeroth == pytest.approx(np.diag(fresnel.amplitudes(wi[2], index)), abs=1e-6)


def test_rayleigh_s_expansion_agrees_with_the_integral_method_on_aluminium():
    truth = shipped("aluminium").where(profile="sinusoidal", theta=60.0)
    for period, depth, allowed in ((2.5, 0.1, 5e-5), (1.1, 0.1, 5e-5), (2.5, 0.2, 5e-4)):
        for row in truth.where(period=period, depth=depth, wavelength=460.0).rows:
            found = sinusoid_of_aluminium(period, depth)
            here = (found.order[:, 0] == row["order"]).argmax()
            share = found.wo[here, 2] / np.cos(np.radians(60.0))
            powers = np.abs(np.diag(found.jones[here])) ** 2 * share
            assert powers == pytest.approx([row["te"], row["tm"]], abs=allowed)


@cache
def sinusoid_of_aluminium(period: float, depth: float) -> crossed.Orders:
    heights = Grating("sinusoidal", period, depth).heights(256)
    wi = np.array([np.sin(np.radians(60.0)), 0.0, np.cos(np.radians(60.0))])
    return rayleigh.solve(heights, index_of("aluminium", 460.0), 460.0, wi, 41)


def test_it_is_reciprocal_between_any_planes():
    field = cell(SURFACES["crossed grating"])
    wi = np.array([0.5, 0.2, np.sqrt(1 - 0.29)])
    there = rayleigh.solve(field, 1 + 6.5j, 550.0, wi, 165)
    signs = np.array([[1.0, -1.0], [-1.0, 1.0]])  # reversed light has the other p
    for n in np.flatnonzero(there.wo[:, 2] > 0.5)[:6]:
        back = rayleigh.solve(field, 1 + 6.5j, 550.0, there.wo[n], 165)
        same = (back.order == there.order[n]).all(axis=1).argmax()
        assert back.wo[same] == pytest.approx(wi, abs=1e-12)
        ratio = wi[2] / there.wo[n, 2]
        assert back.jones[same].T * signs * ratio == pytest.approx(there.jones[n], abs=1e-5)


@pytest.mark.parametrize(("name", "allowed"), [("crossed grating", 1e-6), ("CD's pits, low", 1e-3)])
def test_what_is_reflected_and_what_goes_through_add_up(name, allowed):
    field = cell(SURFACES[name])
    wi = np.array([0.5, 0.2, np.sqrt(1 - 0.29)])
    found = rayleigh.solve(field, 1.56, 550.0, wi, 317)
    back = np.sum(boundary.unpolarised(found.jones) * found.wo[:, 2]) / wi[2]
    below = rayleigh.through(field, 1.56, 550.0, wi, 317)
    through = np.sum(boundary.unpolarised(below.jones) * -1.56 * below.wo[:, 2]) / wi[2]
    assert 0.9 < through < 0.97
    assert back + through == pytest.approx(1.0, abs=allowed)


def test_two_solvers_agree_on_keratin_within_what_layers_and_harmonics_still_change():
    for agreement in agreements():
        assert agreement.deviation < agreement.second_change, agreement.case
        assert agreement.first_change < 0.005, agreement.case


def test_what_is_kept_of_aluminium_has_converged_and_reflects_what_aluminium_does():
    for solution in solved("aluminium")[0]:
        power = solution.efficiency(cell(solution.case.surface))
        assert 0.88 < power.sum() < 0.93  # flat: 0.90 to 0.92
        coloured = (solution.rows["mx"] != 0) | (solution.rows["my"] != 0)
        assert solution.rows["change"][coloured].sum() < 0.02 * power[coloured].sum()


def test_the_solver_agrees_with_what_is_kept():
    pytest.importorskip("grcwa")
    case = PatchCase(SURFACES["sinusoid 2.5/0.05 µm"], "keratin", 550.0, 60.0, 45.0)
    rows = solve_case(case, "coupled_wave")
    kept = next(
        s
        for s in solved("keratin", "coupled_wave")[0]
        if s.case.theta == 60.0 and s.case.phi == 45.0
    )
    assert rows["jones"] == pytest.approx(kept.rows["jones"], abs=1e-5)
