"""Tables of solved orders: their error, refusals; and imported efficiencies."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.solve.jobs import Jobs, problem_of
from mitsuba_diffraction.solve.materials import material_of
from mitsuba_diffraction.solve.nodes import count_for
from mitsuba_diffraction.solve.orders import Settings, measured_error, solve_orders
from mitsuba_diffraction.solve.profiles import Profile, lamellar, read_profile, sinusoidal
from mitsuba_diffraction.solve.stations import Grating
from mitsuba_diffraction.tables.orders import cells

pytest.importorskip("gratinglab")

# two bands and a perfect conductor, which has no third variable: a second's work
PROFILE = sinusoidal(0.5, 0.05)
LOOP = np.array([[0, 0.8, 0.5, 0.5], [0, 0.5, -0.5, 1.0]])
SETTINGS = Settings(wavelengths=(520.0, 640.0), tolerance=0.05, polarised=True)


@pytest.fixture(scope="module")
def table():
    return solve_orders(PROFILE, "none", settings=SETTINGS)


def test_the_measured_error_is_within_the_tolerance(table):
    assert table.header["error_mean"] <= SETTINGS.tolerance
    assert table.header["error_polarised"] <= SETTINGS.tolerance
    assert table.header["reciprocity_error"] <= SETTINGS.tolerance


def test_no_order_is_lost_or_gained_by_a_perfect_conductor(table):
    for x, y, lam in ((0.1, 0.2, 540.0), (-0.6, 0.3, 600.0), (0.0, 0.8, 630.0)):
        total = sum(float(table.efficiency(x, y, lam, m)) for m in range(-3, 4))
        # interpolation, beside the tolerance of 5 % of the orders
        assert total == pytest.approx(1, abs=0.02)


def test_few_nodes_are_chosen_for_smooth_efficiencies():
    at = cells.nodes(24)[:, None, None, None]
    smooth, rough = 1 + 0.1 * at**2, 1 + 0.1 / (1 + 900 * (at - 0.4) ** 2)
    assert count_for(smooth, 2, 1e-6) == 3
    assert count_for(rough, 2, 1e-3) > 12


def test_the_error_compares_with_new_solutions(table):
    perfect = material_of("none", SETTINGS.wavelengths)
    problem = problem_of(Grating(PROFILE, perfect, 1.0, SETTINGS.wavelengths), "integral", 64)
    # within the tolerance of the nodes and that of the solver
    assert measured_error(table, problem, Jobs()).mean < 1.5 * SETTINGS.tolerance


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: lamellar(1.0, -1.0), "depth"),
        (lambda: lamellar(1.0, 0.1, 1.5), "duty"),
        (lambda: Profile(np.array([0, 2.0]), np.zeros(2), 1.0), "one period"),
        (lambda: Profile(np.array([0, np.nan]), np.zeros(2), 1.0), "finite"),
        (lambda: Profile(LOOP[0], LOOP[1], 1.0), "cross"),
        (lambda: md.solve_orders(PROFILE, "Unobtainium"), "no conductor"),
        (lambda: md.solve_orders(PROFILE, "-1"), "index"),
        (lambda: md.solve_orders(PROFILE, "Al", settings=Settings((50.0, 700.0))), "nm"),
        (lambda: Settings(tolerance=2.0), "tolerance"),
        (lambda: md.solve_orders(PROFILE, settings=Settings(method="guess")), "unknown"),
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


HEADER = "wavelength_nm,theta_deg,phi_deg,order,R_s,R_p\n"


def efficiencies_of(table, phis):
    """Lines of a file with what a table has, every 10 nm and 3 degrees."""
    lines = []
    for lam, theta, phi in product(np.arange(520.0, 641.0, 15), np.arange(0.0, 88, 3), phis):
        sine = np.sin(np.radians(theta))
        x, y = -sine * np.cos(np.radians(phi)), sine * np.sin(np.radians(phi))
        step, room = lam / 500.0, np.sqrt(1 - y * y)
        orders = np.arange(np.ceil((-room - x) / step), np.floor((room - x) / step) + 1)
        powers = table.efficiency(x, y, lam, orders)
        lines += [
            f"{lam},{theta},{phi},{m},{power},{power}\n"
            for m, power in zip(orders, powers, strict=True)
        ]
    return lines


@pytest.fixture(scope="module")
def lines(table):
    return efficiencies_of(table, (0, 180))


def test_efficiencies_of_a_file_come_back(table, lines, tmp_path):
    file = tmp_path / "bench.csv"
    file.write_text(HEADER + "".join(lines))
    with pytest.warns(md.DiffractionWarning, match="perfect conductors"):
        imported = md.read_orders(file, 0.5)
    rng = np.random.default_rng(1)
    x, y, lam = rng.uniform(-0.6, 0.6, 40), rng.uniform(-0.6, 0.6, 40), rng.uniform(530, 630, 40)
    for m in (-1, 0, 1):
        # linear interpolation between lights 3 degrees apart; conical light is exact
        error = np.abs(imported.efficiency(x, y, lam, m) - table.efficiency(x, y, lam, m))
        assert error.mean() < 0.02


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: lines[:40] + lines[60:], "hole|no line"),
        (lambda lines: [*lines, "640,87,180,7,0.1,0.1\n"], "does not propagate"),
        (lambda lines: [lines[0].replace(lines[0].split(",")[4], "0.999"), *lines], "twice"),
        (lambda lines: [*lines, "640,9,180,0,1.5,0\n"], "0 to 1"),
        (lambda lines: [*lines, "red\n"], "expected numbers"),
        (lambda lines: [], "no lines"),
    ],
)
def test_a_damaged_file_of_efficiencies_is_refused(lines, tmp_path, change, message):
    file = tmp_path / "bench.csv"
    file.write_text(HEADER + "".join(change(lines)))
    with pytest.raises(DiffractionError, match=message) as caught:
        md.read_orders(file, 0.5)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("theta", "phi"), [(0, 0), (20, 0), (-20, 0), (20, 180)])
def test_one_direction_gives_its_efficiencies_to_all(theta, phi, tmp_path):
    """As an efficiency curve over wavelength has them; θ below 0 is light from the other side."""
    x = -np.sin(np.radians(theta)) * np.cos(np.radians(phi))
    curve, rows = {-2: 0.03, -1: 0.2, 0: 0.3, 1: 0.4, 2: 0.04}, []
    for lam in range(520, 641, 20):
        orders = [m for m in curve if abs(x + m * lam / 800) < 1]
        rows += [f"{lam},{theta},{phi},{m},{curve[m]},{curve[m] / 2}\n" for m in orders]
    file = tmp_path / "curve.csv"
    file.write_text(HEADER + "".join(rows))
    with pytest.warns(md.DiffractionWarning, match="no light from some directions"):
        table = md.read_orders(file, 0.8)
    sine = np.linspace(-0.15, 0.15, 7) + x
    for m in (order for order in curve if abs(x + order * 0.58 / 0.8) < 1):
        inside = np.abs(sine + m * 0.58 / 0.8) < 0.99
        s, p = table.polarised_efficiency(sine[inside], 0.0, 580.0, m).T
        # polynomials through values that are constant, stored with 16 bits
        np.testing.assert_allclose(s, curve[m], atol=2e-4)
        np.testing.assert_allclose(p, curve[m] / 2, atol=2e-4)


def test_sums_above_the_incident_light_are_refused(tmp_path):
    file = tmp_path / "bench.csv"
    file.write_text(HEADER + "600,0,0,0,0.6,0.6\n600,0,0,1,0.3,0.5\n600,0,0,-1,0.3,0.5\n")
    with pytest.raises(DiffractionError, match="orders sum to 1"):
        md.read_orders(file, 0.9)
