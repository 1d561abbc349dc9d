"""Both solvers against each other, closed forms, and gratinglab's documented call."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.orders import cells
from mitsuba_diffraction.orders.polarised import mueller_of
from mitsuba_diffraction.orders.solve.coupled import CoupledWaves
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.integral import IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import blazed, lamellar, sinusoidal
from mitsuba_diffraction.orders.solve.stations import Grating
from mitsuba_diffraction.reference.boundary import mueller, turn
from mitsuba_diffraction.reference.fresnel import amplitudes as fresnel
from mitsuba_diffraction.reference.model import small_slope
from tests.support.orders import groove_matrices

pytest.importorskip("gratinglab")

RANGE = (400.0, 700.0)


def grating(profile, material, superstrate=1.0):
    return Grating(profile, material_of(material, RANGE), superstrate, RANGE)


def powers(solver, station):
    return np.abs(solver.amplitudes(station)) ** 2


@pytest.mark.parametrize(
    "profile", [lamellar(0.8, 0.1, 0.3), blazed(0.8, 0.1)], ids=lambda p: p.name[:7]
)
@pytest.mark.parametrize("place", [(1, 0, 0.3, 0.6), (2, 1, 0.6, 0.5)])
def test_two_solvers_agree_on_dielectrics_in_conical_mounts(profile, place):
    station = grating(profile, 1.5).station(*place, [0.2, 0.8])
    integral = IntegralSolver(profile, 90).amplitudes(station)
    coupled = CoupledWaves(profile, 12).amplitudes(station)
    # phases too; 90 points are within 7e-3 of 200 (corners of the blaze), 12 harmonics of 40
    assert np.abs(integral - coupled).max() < 1e-2
    # 90 points are within 4e-3 of 200, 12 harmonics within 2e-3 of 40
    assert np.abs(np.abs(integral) ** 2 - np.abs(coupled) ** 2).max() < 5e-3


def test_two_solvers_agree_on_walls_of_aluminium():
    profile = lamellar(0.7, 0.1)
    station = grating(profile, "Al", 1.5).station(2, 0, 0.4, 0.7, [0.5])
    integral = powers(IntegralSolver(profile, 130), station).sum(axis=-1)
    coupled = powers(CoupledWaves(profile, 40), station).sum(axis=-1)
    # coupled waves of TM on metal converge slowly: 0.5 % between 40 and 60 harmonics
    assert np.abs(integral - coupled).max() < 0.01


@pytest.mark.parametrize("material", [1.5, "Al"])
@pytest.mark.parametrize("solver", [IntegralSolver, CoupledWaves])
def test_a_flat_surface_reflects_in_phase_and_polarisation_as_fresnel_says(solver, material):
    profile = lamellar(0.7, 1e-6) if solver is CoupledWaves else sinusoidal(0.7, 1e-6)
    station = grating(profile, material).station(1, 0, 0.3, 0.6, [0.4])
    amplitudes = solver(profile, 60 if solver is IntegralSolver else 6).amplitudes(station)[0]
    y, c = station.along[0], np.sqrt(1 - station.along[0] ** 2)
    for channel, sine in enumerate(station.sines):
        x, z = c * sine, c * np.sqrt(1 - sine**2)
        down, up = np.array([x, y, -z]), np.array([x, y, z])
        s = np.array([-y, x, 0]) / np.hypot(x, y)
        along_in, along_out = (([0, 1, 0] - y * d) / c for d in (down, up))
        mirror = np.diag(fresnel(np.asarray(z), station.indices[0]))
        expected = turn(along_out, s, up) @ mirror @ turn(s, along_in, down)
        # 60 points on aluminium: 8e-3; J is (out, in), and the solver's is (in, out)
        assert np.allclose(amplitudes[channel, :, channel].T, expected, atol=1e-2)


def test_a_perfect_conductor_reflects_all_light_whatever_the_wavelength():
    profile = sinusoidal(0.7, 0.1)
    solver, surface = IntegralSolver(profile, 120), grating(profile, "none")
    near, far = (powers(solver, surface.station(2, 0, 0.3, 0.5, [w])) for w in (0.1, 0.9))
    assert np.allclose(near, far, atol=1e-12)
    # 1.1e-3 at 60 points
    assert np.allclose(near.sum(axis=(3, 4)), 1, atol=5e-4)


def test_the_assembly_matches_the_documented_call_of_gratinglab(monkeypatch, tmp_path):
    from gratinglab import materials, profiles
    from gratinglab.illumination import Illumination
    from gratinglab.problem import Problem
    from gratinglab.solvers.integral import integral

    monkeypatch.setenv(materials.LIBRARY_ENV, str(tmp_path))
    index, lam, theta = 0.65 + 5.6j, 460.0, 20.0
    table = materials.OpticalConstants(
        "metal", np.array([400.0, 500.0]), np.full(2, 1 - index.real), np.full(2, index.imag)
    )
    materials.write_ari(table, tmp_path / "metal.ari")
    problem = Problem(period=900.0, profile=profiles.Lamellar(depth_fraction=0.1), coating="metal")
    documented = {
        name: integral.solve(
            problem, Illumination.classical(theta, name), [lam],
            boundary_points=180, corner_grading=4, conductivity="tabulated",
        )
        for name in ("TE", "TM")
    }  # fmt: skip
    profile = lamellar(0.9, 0.09)
    cell = cells.to_cell(-np.sin(np.radians(theta)), 0.0, lam, 0.9)
    surface = Grating(profile, material_of(index, RANGE), 1.0, (lam, lam))
    station = surface.station(
        int(cell.band), int(cell.kind), float(cell.tau), float(cell.rho), [0.0]
    )
    ours = powers(IntegralSolver(profile, 180), station)[0, int(cell.channel)].sum(axis=-1)
    for n, scan in enumerate(documented.values()):
        orders = int(cell.channel) - np.arange(station.channels)
        theirs = scan.efficiency[0, np.searchsorted(scan.orders, orders)]
        # the sums over waves are truncated alike; the Bloch waves differ by whole orders
        assert np.allclose(ours[n], theirs, atol=1e-4)


@pytest.mark.parametrize("material", [1.5, "Al"])
def test_shallow_gratings_polarise_as_the_small_slope_model_says(material):
    shallow = sinusoidal(0.8, 1e-3)
    grating = Grating(shallow, material_of(material, RANGE), 1.0, RANGE)
    station = grating.station(2, 0, 0.3, 0.6, [0.4])
    matrices = mueller_of(IntegralSolver(shallow, 80).amplitudes(station)[0])
    y, c = station.along[0], np.sqrt(1 - station.along[0] ** 2)
    x, z = c * station.sines, c * np.sqrt(1 - station.sines**2)
    for j, q in ((0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 1)):
        wi, wo = np.array([-x[j], -y, z[j]]), np.array([x[q], y, z[q]])
        expected = mueller(groove_matrices(wi, wo, small_slope(wi, wo, station.indices[0])))
        ratio = matrices[j, q] / matrices[j, q, 0, 0]
        # 80 points
        assert ratio == pytest.approx(expected / expected[0, 0], abs=5e-3)
