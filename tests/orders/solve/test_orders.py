"""Tables of solved orders: their error, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders import cells
from mitsuba_diffraction.orders.solve import orders
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import problem_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import (
    lamellar,
    polygon,
    read_profile,
    sinusoidal,
)
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating

pytest.importorskip("gratinglab")

# two bands and a perfect conductor, which has no third variable: a second's work
PROFILE = sinusoidal(0.5, 0.05)
SETTINGS = Settings(wavelengths=(520.0, 640.0), tolerance=0.1, polarised=True)


@pytest.fixture(scope="module")
def announced():
    """A table, and what was said before it was solved."""
    estimates = []
    return solve_orders(PROFILE, "none", settings=SETTINGS, announce=estimates.append), estimates


@pytest.fixture(scope="module")
def table(announced):
    return announced[0]


def test_the_measured_error_is_within_the_tolerance(table):
    for name in ("error_mean", "error_polarised", "reciprocity_error"):
        assert table.header[name] <= 0.5 * SETTINGS.tolerance


def test_a_solution_that_no_longer_changes_has_the_error_of_single_precision():
    settings = Settings(wavelengths=(550.0, 560.0), resolution=9)
    listed = solve_orders(sinusoidal(1.2, 0.1), "Al", theta=[0.0], step=10.0, settings=settings)
    assert 1e-7 < listed.header["solver_error"] < 1e-6  # was 4e-35


def test_no_order_is_lost_or_gained_by_a_perfect_conductor(table):
    for x, y, lam in ((0.1, 0.2, 540.0), (-0.6, 0.3, 600.0), (0.0, 0.8, 630.0)):
        total = sum(float(table.efficiency(x, y, lam, m)) for m in range(-3, 4))
        # interpolation, beside the tolerance of 10 % of the orders
        assert total == pytest.approx(1, abs=0.02)


def test_a_table_gets_more_nodes_where_its_efficiencies_change_quickest():
    flat = md.OrderTable.mirror(0.5, 0.5, SETTINGS.wavelengths)
    at = cells.nodes(6)[:, None]
    quick = 0.1 / (1 + 900 * (at - 0.4) ** 2)  # along ρ, of order -1 of the last band

    def stretched(values, added):
        values = np.broadcast_to(values, (6, 6, 6, *values.shape[3:])).copy()
        values[..., 0, -1, 0] += added
        return values

    bands = [
        orders.Band(band.k, *(stretched(v, quick if band is flat.bands[-1] else 0.0)
                              for v in band.kinds))
        for band in flat.bands
    ]  # fmt: skip
    table = replace(flat, response=orders.CellResponse(tuple(bands)))
    *others, last = orders.refined_counts(table, 0.0).values()
    assert others == [(6, 6, 6)] * len(others)
    assert last == (6, 9, 6)
    # no terms are as large as all light in orders
    assert set(orders.refined_counts(table, 1.0).values()) == {(6, 6, 6)}


def test_the_size_of_a_table_is_announced_before_it_is_solved(announced):
    made, estimates = announced
    solving = [e for e in estimates if e.stage == "solving"]
    assert solving[-1].size == made.nbytes
    assert solving[0].seconds > 0


def test_a_line_is_read_with_its_undercut(tmp_path):
    file = tmp_path / "groove.csv"
    file.write_text("x_um,z_um\n0,0.1\n0.5,0.1\n0.4,0\n0.9,0\n1.0,0.1\n")
    profile = read_profile(file, 1.0)
    # the end of the period is the beginning of the next
    assert len(profile.x) == 4
    assert profile.depth == pytest.approx(0.1)
    assert (np.diff(profile.x) < 0).any()


def test_columns_of_a_line_have_the_order_of_their_names(tmp_path):
    """Depth and period are alike, so that no length tells which column is x."""
    (tmp_path / "xz.csv").write_text("x,z\n0,0\n0.2,0.9\n0.6,0.3\n")
    (tmp_path / "zx.csv").write_text("z_nm;x_nm\n0;0\n900;200\n300;600\n")
    one, other = (read_profile(tmp_path / f"{name}.csv", 1.0) for name in ("xz", "zx"))
    np.testing.assert_allclose([other.x, other.z], [one.x, one.z], atol=1e-12)


def test_a_ridge_that_leans_over_the_next_period_is_moved():
    leaning = polygon([(0, 0), (0.5, 0), (0.9, 0.3), (1.2, 0.3), (0.9, 0)], 1.0)
    np.testing.assert_allclose(leaning.x, [0, 0.4, 0.7, 0.4, 0.5])
    np.testing.assert_allclose(leaning.z, [0, 0.3, 0.3, 0, 0])


def test_a_table_that_misses_its_tolerance_is_refined_and_then_warned_of(monkeypatch):
    monkeypatch.setattr(orders, "REFINEMENTS", 0)
    monkeypatch.setattr(orders, "COUNTS", orders.Counts(2, 2, 1))
    exact = replace(SETTINGS, tolerance=1e-3, resolution=16)
    with pytest.warns(md.DiffractionWarning, match=r"5 % of directions .tolerance 0.40%"):
        coarse = solve_orders(PROFILE, "none", settings=exact)
    monkeypatch.setattr(orders, "REFINEMENTS", 1)
    with pytest.warns(md.DiffractionWarning, match="on average"):
        finer = solve_orders(PROFILE, "none", settings=exact)
    assert finer.header["error_mean"] < coarse.header["error_mean"]


def test_slopes_are_solved_by_chandezon_s_method_and_walls_by_coupled_waves():
    aluminium = material_of("Al", SETTINGS.wavelengths)
    for profile, method in ((PROFILE, "chandezon"), (lamellar(0.5, 0.05), "coupled")):
        grating = Grating(profile, aluminium, 1.0, SETTINGS.wavelengths)
        assert problem_of(grating, "auto", 0).method == method


@pytest.mark.parametrize("period", [1.58, 1.59, 1.595, 1.6])
def test_a_sampled_line_may_end_a_point_before_its_period(tmp_path, period):
    file = tmp_path / "groove.csv"
    np.savetxt(file, np.column_stack([0.01 * np.arange(159), np.zeros(159)]), delimiter=",")
    assert len(read_profile(file, period).x) >= 158


def test_a_line_whose_ends_differ_gets_a_wall_and_a_warning(tmp_path):
    file = tmp_path / "groove.csv"
    file.write_text("0,0\n0.5,0.1\n1,0.02\n")
    with pytest.warns(md.DiffractionWarning, match="vertical wall"):
        assert read_profile(file, 1.0).depth == pytest.approx(0.1)
