"""Tables beside other solutions: of twice the resolution at random light, and of another solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders.solve import accuracy, orders
from mitsuba_diffraction.orders.solve.accuracy import (
    by_polarisation,
    diffuse_light,
    measured_error,
)
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import Jobs, problem_of
from mitsuba_diffraction.orders.solve.nodes import located
from mitsuba_diffraction.orders.solve.profiles import (
    UnitCell,
    blazed,
    lamellar,
)
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating
from tests.orders.kinds import light

pytestmark = pytest.mark.thorough

RANGE, LIGHTS = (550.0, 570.0), 60
#: Profile, material, arguments and settings: with mirror planes and without.
CASES = {
    "walls": (lamellar(0.8, 0.45), "Al", {}, {"tolerance": 0.01, "resolution": 12}),
    "blazed": (blazed(0.5, 0.15), "Al", {}, {"tolerance": 0.01}),
    "block": (lamellar(0.45, 0.05), 1.5, {"block": True}, {"tolerance": 0.05}),
}


def missed(table, fine, jobs, x, y, lam):
    """Missed shares of a table beside solutions of a problem, of light (n,)."""
    lights = located(fine.grating, x, y, lam)
    amplitudes = jobs.amplitudes(fine, [each.place for each in lights], "")
    index, shares = table.block or 1.0, []
    for n, (place, port, leaving) in enumerate(lights):
        guided = table.block and index * np.hypot(x[n], y[n]) >= 1.0
        side = 0 if guided else n % table.sides
        at = index * x[n], index * y[n], lam[n], *leaving.T
        truth, found = by_polarisation(
            table, amplitudes[place], at, side * len(leaving) + port, side
        )
        shares.append(np.abs(found - truth).sum() / truth.sum())
    return np.array(shares)


@pytest.mark.parametrize("name", CASES)
def test_light_that_was_not_solved_has_the_light_of_a_direct_solution(name, monkeypatch):
    """In all orders and both polarisations."""
    profile, material, arguments, settings = CASES[name]
    problems, jobs = [], Jobs()

    def spy(table, problem, jobs):
        problems.append(problem)
        return measured_error(table, problem, jobs)

    monkeypatch.setattr(orders, "measured_error", spy)
    how = Settings(RANGE, **settings)
    table = md.solve_orders(profile, material, settings=how, jobs=jobs, **arguments)
    fine = replace(problems[-1], resolution=2 * problems[-1].resolution)
    shares = missed(table, fine, jobs, *light(LIGHTS, 1.0, RANGE, seed=77))
    # of the order of a picture's noise; the worst lie beside surface plasmons, in TM
    assert shares.mean() < 0.015
    assert shares.max() < 0.05


def test_a_crossed_grating_has_the_light_of_a_direct_solution_between_its_directions(monkeypatch):
    pillar = np.zeros((4, 4))
    pillar[1:3, 1:3] = 0.1
    field = md.HeightField(pillar, 0.5 / 4, periodic=True)
    how, jobs = Settings(RANGE, tolerance=0.1, resolution=3), Jobs()
    monkeypatch.setattr(accuracy, "SAMPLES", LIGHTS)
    table = md.solve_orders(field, 1.5, step=20.0, settings=how, jobs=jobs)
    # of the weak orders alone
    assert 0.0 < table.header["error_mean"] < 0.03
    assert table.header["solver_error"] < 0.01
    normal = table.efficiency(0.0, 0.0, 560.0, [1, 0, -1, 0], [0, 1, 0, -1])
    assert normal == pytest.approx(normal[0], rel=1e-3)
    cell = UnitCell(field.heights, field.extent)
    # twice the resolution takes 40 times as long
    alike = problem_of(Grating(cell, material_of(1.5, RANGE), 1.0, RANGE), "auto", 3)
    # the light that the error was measured by is solved already, and refines no table
    shares = missed(table, alike, jobs, *diffuse_light(LIGHTS, RANGE))
    assert shares.mean() < 0.015
    assert shares.max() < 0.05
