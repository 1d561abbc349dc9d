"""Surfaces in two dimensions: their cells, the kept solutions, and the model beside them."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import crossed
from docs.make.validation.patch_sections import PatchComparison, compared
from docs.make.validation.patch_solutions import solve_case, solved
from docs.make.validation.patches import KINDS, MEASURED, SURFACES, PatchCase, cell
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.optics import boundary, fresnel

HERE = [kind for kind in KINDS if kind != "elaphe" or MEASURED.is_file()]


@pytest.fixture(scope="module")
def keratin() -> list[PatchComparison]:
    return compared("keratin")


@pytest.mark.parametrize("surface", [s for s in SURFACES.values() if s.kind in HERE], ids=str)
def test_a_cell_has_its_slope_and_no_seam(surface):
    field = cell(surface)
    assert field.heights.mean() == pytest.approx(0, abs=1e-12)
    # its band-limited slope; differences of neighbours see a little less
    assert field.rms_slope == pytest.approx(surface.slope, rel=0.06)
    inside = np.abs(np.diff(field.heights, axis=1)).max()
    assert np.abs(field.heights[:, 0] - field.heights[:, -1]).max() <= 1.5 * inside


def test_the_orders_of_a_kept_solution_carry_what_a_dielectric_reflects():
    for solution in solved("keratin")[0]:
        if solution.case.surface.kind not in HERE:
            continue
        field = cell(solution.case.surface)
        assert np.all(solution.wo(field)[:, 2] > 0)
        assert 0.03 < solution.efficiency(field).sum() < 0.12  # flat: 0.048 to 0.099


def test_cuts_of_scales_meet_the_goals(keratin):
    cuts = [
        c.by_model["small_slope"]
        for c in keratin
        if c.case.surface.kind in ("elaphe", "elaphe_like") and c.case.surface.slope == 0.2
    ]
    assert len(cuts) >= 6
    assert np.mean(cuts) < 0.07
    assert max(cuts) < 0.10


def test_sinusoids_in_any_mount_and_crossed_gratings_are_nearly_exact(keratin):
    for c in keratin:
        if c.case.surface.kind in ("sinusoid", "crossed"):
            assert c.by_model["small_slope"] < 0.03, c.case
            # the solutions are not better than this
            assert c.by_model["small_slope"] < c.by_model["kirchhoff"] + c.change, c.case


def test_cross_polarised_light_has_the_sign_and_size_of_coupled_waves():
    checked = 0
    for solution in solved("keratin")[0]:
        if solution.case.surface.name != "sinusoid 2.5/0.05 µm":
            continue
        wo = solution.wo(cell(solution.case.surface))
        matrix = boundary.small_slope(solution.wi, wo, 1.56)
        for truth, mine, number in zip(
            solution.rows["jones"], matrix, solution.rows["mx"], strict=True
        ):
            if abs(number) == 1:
                # relative to s in, s out: phases of the height's zero are no matter
                assert mine / mine[0, 0] == pytest.approx(truth / truth[0, 0], abs=0.01)
                checked += abs(mine[1, 0] / mine[0, 0]) > 0.1
    assert checked >= 4


def test_the_solver_gives_a_mirror_fresnel_s_coefficients():
    pytest.importorskip("grcwa")
    wi = np.array([0.5, 0.3, np.sqrt(1 - 0.34)])
    field = HeightField(
        1e-9 * np.cos(2 * np.pi * np.arange(16) / 16) * np.ones((2, 1)), (0.1, 0.01)
    )
    found = crossed.solve(field, 1.56, 550.0, wi, 5, 2)
    zeroth = found.jones[(found.order == 0).all(axis=1)][0]
    r_s, r_p = fresnel.amplitudes(wi[2], 1.56)
    assert zeroth == pytest.approx(np.diag([r_s, r_p]), abs=1e-6)


def test_the_solver_agrees_with_what_is_kept():
    pytest.importorskip("grcwa")
    case = PatchCase(SURFACES["sinusoid 2.5/0.05 µm"], "keratin", 550.0, 60.0, 45.0)
    rows = solve_case(case)
    kept = next(s for s in solved("keratin")[0] if s.case.theta == 60.0 and s.case.phi == 45.0)
    assert rows["jones"] == pytest.approx(kept.rows["jones"], abs=1e-5)
