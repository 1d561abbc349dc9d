"""Solutions in other processes, the command, the shipped tables, and published gratings."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.cli import main
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import Jobs, calls_in, problem_of, processes, solve_place
from mitsuba_diffraction.orders.solve.nodes import Place
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import lamellar, polygon, sinusoidal
from mitsuba_diffraction.orders.solve.recipes import SolvedRecipe
from mitsuba_diffraction.orders.solve.resolution import STEP, coarsest
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating
from tests.support import ROOT

pytestmark = pytest.mark.thorough

PROFILE, RANGE = sinusoidal(0.5, 0.05), (520.0, 640.0)


def test_a_solution_is_the_same_in_this_process_and_another():
    pytest.importorskip("gratinglab")
    problem = problem_of(Grating(PROFILE, material_of("none", RANGE), 1.0, RANGE), "integral", 48)
    place = Place(1, 0, 0.3, 0.4, (0.5,))
    with processes(1) as pool:
        elsewhere = Jobs(calls=partial(calls_in, pool)).amplitudes(problem, [place], "")[place]
    # sums of BLAS in another order, rounded to single precision
    assert np.allclose(elsewhere, solve_place(problem, place).values, atol=1e-7)


RECIPE = """method = "solved"
profile = "sinusoidal"
material = "none"
wavelengths = [540, 560]
tolerance = 0.2
output = "groove.nc"
[arguments]
period = 0.5
depth = 0.05
"""


def test_the_command_says_what_it_will_do_writes_the_table_and_clears_up(tmp_path, capsys):
    recipe = tmp_path / "groove.toml"
    recipe.write_text(RECIPE)
    assert main(["solve", str(recipe), "--json", str(tmp_path / "groove.json")]) == 0
    captured = capsys.readouterr()
    assert "solutions at" in captured.err
    assert "about" in captured.err
    assert "reciprocity" in captured.out
    assert OrderTable.load(tmp_path / "groove.nc").period == 0.5
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "groove.json", "groove.nc", "groove.toml",
    ]  # fmt: skip


def test_the_shipped_tables_are_those_of_their_recipes():
    files = sorted((ROOT / "precompute" / "orders").glob("*.nc"))
    assert sum(file.stat().st_size for file in files) < 10e6
    for file in files:
        table, recipe = OrderTable.load(file), SolvedRecipe.load(file.with_suffix(".toml"))
        assert table.period == recipe.profile.period
        assert table.header["profile"] == recipe.profile.name
        assert table.wavelengths == recipe.settings.wavelengths
        assert table.superstrate == recipe.superstrate
        assert table.header["error_mean"] <= recipe.settings.tolerance
        assert table.header["reciprocity_error"] < 0.01


def test_an_echelle_sends_its_light_back_into_the_order_of_its_blaze():
    """R2, 79 lines/mm, aluminium: 2 d sin θ = m λ has m = 41 at 552 nm."""
    period, tangent = 1e3 / 79, 2.0
    width = period / (1.0 + tangent**2)
    echelle = polygon([(0, 0), (width, width * tangent)], period)
    theta = np.degrees(np.arctan(tangent))
    lam = 2e3 * period * np.sin(np.radians(theta)) / 41
    settings = Settings(wavelengths=(lam, lam), resolution=80)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(echelle, "Al", theta=-theta, settings=settings)
    efficiency = table.polarised_efficiency(np.sin(np.radians(theta)), 0.0, lam, -41)
    # the facet is 41 half waves deep: most of R = 0.91 but for shadowed edges
    assert efficiency[0] > 0.6
    # its next resolution
    assert table.header["solver_error"] < 1e-3


def test_the_first_resolution_of_an_echelle_carries_the_waves_along_its_facets():
    """R4, 63 lines/mm: no light from nothing, and Littrow's order is the brightest."""
    period, tangent, lam = 15.873, 4.0, (550.0, 550.0)
    width = period / (1.0 + tangent**2)
    echelle = polygon([(0, 0), (width, width * tangent)], period)
    grating = Grating(echelle, material_of("Al", lam), 1.0, lam)
    first = coarsest(problem_of(grating, "auto", 0))
    settings = Settings(wavelengths=lam, resolution=int(np.ceil(first * STEP)))
    sine = float(np.sin(np.arctan(tangent)))
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(
            echelle, "Al", theta=-np.degrees(np.arctan(tangent)), settings=settings
        )
    # with fewer harmonics than waves along a facet, efficiencies sum to 1e11 and more; the first
    # resolution, which has as many, misses 27 % of this light, and the second one is exact
    assert table.header["solver_error"] < 1e-3
    orders = table.response.orders[:, 0]
    shares = table.efficiency(sine, 0.0, lam[0], orders)
    assert shares.sum() < 1.0
    assert abs(orders[shares.argmax()] + 2.0 * sine * period / 0.55) <= 1.0


def test_one_direction_of_a_long_period_is_a_small_table():
    """Aluminium, 0.1 µm deep: its reflectance in all orders, a megabyte at most for 61 waves."""
    settings = Settings(wavelengths=(550.0, 550.0), tolerance=0.02)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(sinusoidal(50.0, 0.1), "Al", theta=20.0, settings=settings)
    assert 61 * table.nbytes < 1e6
    shares = table.efficiency(-np.sin(np.radians(20.0)), 0.0, 550.0, table.response.orders[:, 0])
    assert shares.sum() == pytest.approx(0.915, abs=0.01)


def test_a_slit_of_gold_is_that_of_lalanne_and_hugonin():
    """J. Opt. Soc. Am. A 17, 1033 (2000), table: order −1 of s light 0.73428, order 0 of p 0.84848.

    Order −1 there is order 1 here. s converges as N⁻², p more slowly.
    """
    slit = lamellar(1.0, 1.0)
    settings = Settings(wavelengths=(1000.0, 1000.0), tolerance=2e-4)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(slit, "0.22+6.71i", theta=30.0, settings=settings)
    light = -0.5, 0.0, 1000.0
    assert table.polarised_efficiency(*light, 1)[0] == pytest.approx(0.73428, abs=1e-4)
    assert table.polarised_efficiency(*light, 0)[1] == pytest.approx(0.84848, abs=1e-3)
