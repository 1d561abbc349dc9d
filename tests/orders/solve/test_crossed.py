"""Solutions of crossed gratings, beside solvers of grooves and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, HeightField
from mitsuba_diffraction.orders import cells
from mitsuba_diffraction.orders.solve.crossed import UnitCell, _mirrors, _reduced, reflected
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.integral import IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import Profile
from mitsuba_diffraction.orders.solve.stations import Grating

PERIOD, LAM, LIMITS, PIXELS = 0.6, 550.0, (500.0, 700.0), 24
GLASS = material_of(1.5, LIMITS)
Y, X = np.mgrid[:PIXELS, :PIXELS] / PIXELS


def steps(t):
    """Two steps to one side: blazed, so that signs of orders and angles show."""
    return np.where(t < 1 / 3, 0.2, np.where(t < 2 / 3, 0.1, 0.0))


def of_grooves(theta, phi):
    """Unpolarised efficiencies of `steps` by the boundary integral method, by order."""
    x, z = np.array([0.0, 0.2, 0.2, 0.4, 0.4, 0.6]), np.repeat([0.2, 0.1, 0.0], 2)
    grating = Grating(Profile(x, z, PERIOD), GLASS, 1.0, LIMITS)
    sine, turn = np.sin(np.radians(theta)), np.radians(phi)
    cell = cells.to_cell(-sine * np.cos(turn), sine * np.sin(turn), LAM, PERIOD)
    w = float(cells.w_of(cell.k_continuous, LAM, LIMITS, PERIOD))
    place = int(cell.band), int(cell.kind), float(cell.tau), float(cell.rho), (w,)
    solver = IntegralSolver(grating.profile, 60)
    j = int(cell.channel)
    powers = np.abs(solver.amplitudes(grating.station(*place))[0, j]) ** 2
    return {j - q: float(power) for q, power in enumerate(powers.sum(axis=-1).mean(axis=0))}


@pytest.mark.parametrize("phi", [0.0, 20.0])
@pytest.mark.parametrize("along", ["x", "y"])
def test_grooves_have_the_light_of_the_integral_method(along, phi):
    heights, turn = (steps(X), 0.0) if along == "x" else (steps(Y), 90.0)
    cell = UnitCell(
        HeightField(heights, PERIOD / PIXELS), GLASS, (8, 1) if turn == 0.0 else (1, 8), 2
    )
    found = reflected(cell, (30.0, phi + turn), np.array([LAM]), (1, 1))[0]
    across = found[1] if along == "x" else found[:, 1]
    for order, truth in of_grooves(30.0, phi).items():
        assert across[1 + order] == pytest.approx(truth, rel=0.01)  # 0.5 % with 17 harmonics
    assert found.sum() == pytest.approx(across.sum(), rel=1e-9)


@pytest.mark.parametrize("theta", [0.0, 50.0])
def test_a_flat_cell_reflects_as_fresnel_has_it(theta):
    cell = UnitCell(HeightField(np.zeros((4, 4)), 0.1), GLASS, (1, 1), 2)
    inside = np.sqrt(1.5**2 - np.sin(np.radians(theta)) ** 2)
    c = np.cos(np.radians(theta))
    truth = 0.5 * ((c - inside) / (c + inside)) ** 2
    truth += 0.5 * ((2.25 * c - inside) / (2.25 * c + inside)) ** 2
    found = reflected(cell, (theta, 30.0), np.array([LAM]), (0, 0))
    assert found[0, 0, 0] == pytest.approx(truth, rel=1e-6)


def test_mirror_planes_give_the_light_of_mirrored_directions():
    blazed_along_y = HeightField(0.05 * np.cos(2 * np.pi * X) + steps(Y), PERIOD / PIXELS)
    assert _mirrors(blazed_along_y) == (True, False)
    cell = UnitCell(blazed_along_y, GLASS, (2, 2), 2)
    for phi in (130.0, 200.0, 290.0):
        light, flips = _reduced((40.0, phi), (True, False))
        direct = reflected(cell, (40.0, phi), np.array([LAM]), (1, 1))
        mirrored = reflected(cell, light, np.array([LAM]), (1, 1))[:, :: flips[1], :: flips[0]]
        assert mirrored == pytest.approx(direct, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize(
    ("field", "material", "message"),
    [
        (HeightField(np.zeros((4, 4)), 2.0), 1.5, "four times the shortest wavelength"),
        (HeightField(np.zeros((4, 4)), 0.1), "none", "perfect conductors are not solved"),
        (HeightField(np.zeros((4, 4)), 0.1), "glas", "material"),
    ],
)
def test_what_is_not_solved_is_refused(field, material, message):
    with pytest.raises(DiffractionError, match=message):
        md.solve_crossed(field, material)


def test_an_interrupted_solution_goes_on(tmp_path, monkeypatch):
    flat = HeightField(np.zeros((4, 4)), 0.05)
    coarse = {"wavelengths": (500.0, 500.0), "theta_step": 40.0, "phi_step": 90.0, "harmonics": 1}
    folder = tmp_path / "stored"

    def interrupt(done, total, text):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        md.solve_crossed(flat, 1.5, **coarse, folder=folder, progress=interrupt)
    assert len(list(folder.iterdir())) == 2
    started = []
    table = md.solve_crossed(
        flat, 1.5, **coarse, folder=folder, progress=lambda *told: started.append(told)
    )
    assert started[0][0] == 2
    assert table.efficiency(0.0, 0.0, 500.0, 0, 0) == pytest.approx(0.04, rel=1e-3)
    # another material has results of its own
    md.solve_crossed(
        flat, 1.6, **coarse, folder=folder, progress=lambda *told: started.append(told)
    )
    assert (0, started[0][1]) in {told[:2] for told in started}
