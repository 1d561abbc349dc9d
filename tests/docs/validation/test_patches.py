"""Surfaces in two dimensions: their cells, the kept solutions, and the model beside them."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import crossed, rayleigh
from docs.make.validation.cases import Case, Grating, Light, Media, Sampled
from docs.make.validation.compare import Comparison, Sides
from docs.make.validation.models import by_model, of_cells
from docs.make.validation.patches import CELLS, measured_cuts
from docs.make.validation.solutions import shipped
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.reference import fresnel, model

pytestmark = pytest.mark.thorough


KERATIN = shipped("keratin", "patches_rayleigh")
#: Light at 35.7° from between the axes.
SLANTED = Light(550.0, float(np.degrees(np.arcsin(np.hypot(0.5, 0.3)))), 31.0)


@pytest.fixture(scope="module")
def keratin() -> Sides:
    return by_model(KERATIN)


@pytest.mark.parametrize("cell", CELLS.values(), ids=str)
def test_a_cell_has_its_slope_and_no_seam(cell):
    field = cell.field
    assert field.heights.mean() == pytest.approx(0, abs=1e-12)
    # its band-limited slope; differences of neighbours see a little less
    assert field.rms_slope == pytest.approx(cell.slope, rel=0.06)
    inside = np.abs(np.diff(field.heights, axis=1)).max()
    assert np.abs(field.heights[:, 0] - field.heights[:, -1]).max() <= 1.5 * inside


def test_the_orders_of_a_kept_solution_carry_what_a_dielectric_reflects():
    for solution in KERATIN.solved:
        assert np.all(solution.wo[:, 2] > 0)
        assert 0.03 < solution.powers.mean(axis=1).sum() < 0.12  # flat: 0.048 to 0.099


def test_what_is_kept_of_the_measured_scale_is_what_it_gives(shared_afm):
    patch = HeightField.load(shared_afm / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375)
    for name, cut in measured_cuts(patch).items():
        heights = CELLS[name].field.heights
        scaled = (cut.heights - cut.heights.mean()) * np.ptp(heights) / np.ptp(cut.heights)
        assert heights == pytest.approx(scaled, abs=1e-6)  # µm; single precision


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


@pytest.mark.parametrize("material", ["keratin", "aluminium"])
@pytest.mark.parametrize("solver", [crossed, rayleigh], ids=["coupled waves", "rayleigh"])
def test_the_solvers_give_a_mirror_fresnel_s_coefficients(solver, material):
    if solver is crossed:
        pytest.importorskip("grcwa")
    heights = 1e-9 * np.cos(2 * np.pi * np.arange(16) / 16) * np.ones((2, 1))
    case = Case(Sampled(HeightField(heights, (0.1, 0.01))), SLANTED, Media(material))
    found = solver.solve(case, (5, 2) if solver is crossed else 5)
    zeroth = found.jones[(found.order == 0).all(axis=1)][0]
    expected = np.diag(fresnel.amplitudes(case.wi[2], case.index))
    assert zeroth == pytest.approx(expected, abs=1e-6)


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


def test_what_is_kept_of_aluminium_has_converged_and_reflects_what_aluminium_does():
    for solution in shipped("aluminium", "patches_rayleigh").solved:
        power = solution.powers.mean(axis=1)
        assert 0.88 < power.sum() < 0.93  # flat: 0.90 to 0.92
        coloured = (solution.order != 0).any(axis=1)
        assert solution.change.mean(axis=1)[coloured].sum() < 0.02 * power[coloured].sum()
