"""Solutions in other processes, the command, and the shipped tables."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.cli import main
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import Jobs, problem_of, processes, solve_place
from mitsuba_diffraction.orders.solve.nodes import Place
from mitsuba_diffraction.orders.solve.profiles import sinusoidal
from mitsuba_diffraction.orders.solve.recipes import SolvedRecipe
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating
from tests.support import ROOT

pytestmark = pytest.mark.thorough
pytest.importorskip("gratinglab")

PROFILE, RANGE = sinusoidal(0.5, 0.05), (520.0, 640.0)
SETTINGS = Settings(RANGE, tolerance=0.1)


def test_a_solution_is_the_same_in_this_process_and_another():
    problem = problem_of(Grating(PROFILE, material_of("none", RANGE), 1.0, RANGE), "integral", 48)
    place = Place(1, 0, 0.3, 0.4, (0.5,))
    with processes(1) as pool:
        elsewhere = Jobs(executor=pool).amplitudes(problem, [place], "")[place]
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
