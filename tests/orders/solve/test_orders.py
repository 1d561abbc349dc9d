"""Tables of solved orders: their error, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, HeightField
from mitsuba_diffraction.orders import cells
from mitsuba_diffraction.orders.solve import orders
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import problem_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import (
    Profile,
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
LOOP = np.array([[0, 0.8, 0.5, 0.5], [0, 0.5, -0.5, 1.0]])
SPIKE = np.array([[0, 0.4, 0.4, 0.4, 0.9], [0, 0, 0.1, 0, 0]])
SETTINGS = Settings(wavelengths=(520.0, 640.0), tolerance=0.1, polarised=True)
COARSE = Settings(wavelengths=(550.0, 550.0), resolution=12)
WALLS, MANY = lamellar(0.8, 0.1, 0.3), np.arange(80)


def flat(pixel_size):
    """A flat cell of a crossed grating."""
    return HeightField(np.zeros((4, 4)), pixel_size)


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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: lamellar(1.0, -1.0), "depth"),
        (lambda: lamellar(1.0, 0.1, 1.5), "duty"),
        (lambda: Profile(np.array([0, 2.0]), np.zeros(2), 1.0), "one period"),
        (lambda: Profile(np.array([0, np.nan]), np.zeros(2), 1.0), "finite"),
        (lambda: Profile(LOOP[0], LOOP[1], 1.0), "cross"),
        (lambda: polygon([(0, 0), (0.5, 0.1), (0.9, 0.3), (1.45, 0.02), (0.9, 0)], 1.0),
         "crosses itself"),
        (lambda: Profile(SPIKE[0], SPIKE[1], 1.0), "turns back"),
        (lambda: md.solve_orders(PROFILE, "Unobtainium"), "is unknown"),
        (lambda: md.solve_orders(PROFILE, "-1"), "index"),
        (lambda: md.solve_orders(PROFILE, "Al", settings=Settings((50.0, 700.0))), "nm"),
        (lambda: Settings(tolerance=2.0), "tolerance"),
        (lambda: md.solve_orders(PROFILE, settings=Settings(method="guess")), "unknown"),
        (lambda: md.solve_orders(lamellar(1.0, 90.0)), "lengths are in µm"),
        (lambda: md.solve_orders(lamellar(900.0, 0.1)), "directions of light alone"),
        (lambda: md.solve_orders("cd.toml"), "expected a profile"),
        # listed light
        (lambda: md.solve_orders(PROFILE, "Al", theta=95.0), "theta 95 must be"),
        (lambda: md.solve_orders(PROFILE, "Al", theta=MANY, phi=MANY, step=0.1),
         "choose fewer directions"),
        (lambda: md.solve_orders(sinusoidal(8.0, 0.06), "Al", theta=0.0, settings=COARSE),
         "resolution of at least 14"),
        (lambda: md.solve_orders(sinusoidal(8.0, 0.06), 1.5, theta=0.0, settings=COARSE),
         "resolution of at least 14"),
        # thin sheets and blocks
        (lambda: md.solve_orders(WALLS, "Al", thin=True), "clear"),
        (lambda: md.solve_orders(WALLS, "none", thin=True), "clear"),
        (lambda: md.solve_orders(WALLS, "1.5+0.1i", thin=True), "clear"),
        (lambda: md.solve_orders(WALLS, "1.005", thin=True), "1.01"),
        (lambda: md.solve_orders(WALLS, "1.5", thin=True, superstrate=1.3), "both sides"),
        (lambda: md.solve_orders(WALLS, "Al", block=True), "clear"),
        (lambda: md.solve_orders(WALLS, "1.5+0.1i", block=True), "clear"),
        (lambda: md.solve_orders(WALLS, "6", block=True), "1.01 to 5"),
        (lambda: md.solve_orders(WALLS, "1.5", settings=Settings(method="integral"), block=True),
         "coupled"),
        (lambda: md.solve_orders(WALLS, "1.5", settings=Settings(polarised=True), block=True),
         "efficiencies alone"),
        # crossed gratings
        (lambda: md.solve_orders(flat(2.0)), "4 times the shortest wavelength"),
        (lambda: md.solve_orders(HeightField(20.0 * np.eye(4), 0.1), 1.5),
         "heights.* are 20 µm.* in µm"),
        (lambda: md.solve_orders(flat(0.1), "none"), "perfect conductors"),
        (lambda: md.solve_orders(flat(0.1), "glas"), "material"),
        (lambda: md.solve_orders(flat(0.1), 1.5, thin=True), "leave out"),
    ],
)  # fmt: skip
def test_what_cannot_be_solved_is_refused_in_one_line(make, message):
    with pytest.raises(DiffractionError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


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


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("0,1\n800,1\n800,0\n", "one period is 0 to 1.6 µm"),
        ("0,1\n0.3,1\n0.4,0\n", "covers 0.4 µm of a period"),
        ("0,0\n0.2,0.1\n0.6,0.1\n0.8,0\n", "covers 0.8 µm of a period"),
        ("".join(f"{0.01 * n},0\n" for n in range(150)), "covers 1.49 µm of a period"),
        ("x,z\n0,1\n0.3\n", "line 3"),
        ("0,1,2\n", "line 1"),
        ("0,nan\n1,0\n", "line 1"),
        ("# nothing\n", "no points"),
        ("wavelength_nm,theta_deg,order,R_s,R_p\n500,0,0,1,1\n", "read_orders"),
    ],
)
def test_lines_that_are_no_period_are_refused(points, message, tmp_path):
    file = tmp_path / "groove.csv"
    file.write_text(points)
    with pytest.raises(DiffractionError, match=message) as caught:
        read_profile(file, 1.6)
    assert "\n" not in str(caught.value)


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
