"""Solvers beside printed efficiencies, and Chandezon's method beside the integral method."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation.light import light_of
from docs.make.validation.published import PUBLISHED
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.orders.solve import Chandezon, CoupledWaves, IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import blazed, lamellar, sinusoidal

pytest.importorskip("gratinglab")

CONICAL, SHALLOW, DEEP, *TRUNCATED = PUBLISHED
ALUMINIUM = 0.97 + 6.4j


def misses(case, solver):
    solved = case.solved(solver)
    return max(abs(solved[key] - printed) for key, printed in case.printed.items())


@pytest.mark.parametrize(
    "case", [CONICAL, SHALLOW, TRUNCATED[0]], ids=["conical", "shallow", "deep"]
)
def test_the_integral_method_finds_printed_efficiencies(case):
    assert misses(case, IntegralSolver(case.profile, case.points)) < case.tolerance


def test_chandezon_s_method_finds_printed_efficiencies_in_a_conical_mount():
    assert misses(CONICAL, Chandezon(CONICAL.profile, 15)) < CONICAL.tolerance


def test_coupled_waves_find_printed_efficiencies_of_walls_of_metal():
    # TM of 121 harmonics misses the exact value by 1.0e-3 in the table of Lalanne and Hugonin, too
    for case in (SHALLOW, DEEP):
        assert misses(case, CoupledWaves(case.profile, 60)) < 1.2e-3


def test_coupled_waves_find_what_another_program_finds_with_as_many_harmonics():
    # metal in conical mounts
    for case in TRUNCATED:
        assert misses(case, CoupledWaves(case.profile, case.harmonics)) < 2e-4


@pytest.mark.parametrize(
    ("profile", "points", "tolerance"),
    # the integral method nears Chandezon's as points⁻³
    [(sinusoidal(0.9, 0.12), 150, 5e-4), (blazed(1.6667, 0.2939), 240, 4e-3)],
    ids=["sinusoidal", "blazed"],
)
def test_chandezon_s_method_agrees_with_the_integral_method_in_conical_mounts(
    profile, points, tolerance
):
    station = light_of(profile.period, 0.55, ALUMINIUM, 0.4, 0.5).station
    amplitudes = Chandezon(profile, 15).amplitudes(station)
    others = IntegralSolver(profile, points).amplitudes(station)
    # phases and polarisations too
    assert np.abs(amplitudes - others).max() < tolerance


def test_walls_on_both_sides_are_refused():
    with pytest.raises(DiffractionError, match="walls on both sides"):
        Chandezon(lamellar(1.0, 0.1), 10)
