"""Both solvers against each other, and against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.orders.polarised import mueller_of
from mitsuba_diffraction.orders.solve.coupled import CoupledWaves
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.integral import IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import blazed, lamellar, polygon, sinusoidal
from mitsuba_diffraction.orders.solve.stations import Grating
from mitsuba_diffraction.reference.boundary import mueller
from mitsuba_diffraction.reference.model import small_slope
from tests.support.orders import groove_matrices

pytest.importorskip("gratinglab")

RANGE = (400.0, 700.0)


def grating(profile, material, superstrate=1.0, thin=False):
    return Grating(profile, material_of(material, RANGE), superstrate, RANGE, thin=thin)


def powers(solver, station):
    return np.abs(solver.amplitudes(station)) ** 2


#: A ridge that leans over the groove, and the cross-section of a T.
LEANING = polygon([(0.0, 0.0), (0.05, 0.1), (0.35, 0.1), (0.3, 0.0)], 0.8)
T_SHAPED = polygon(
    [(0.2, 0.0), (0.2, 0.05), (0.1, 0.05), (0.1, 0.1),
     (0.6, 0.1), (0.6, 0.05), (0.4, 0.05), (0.4, 0.0)],
    0.8,
)  # fmt: skip
WALLS = lamellar(0.8, 0.1, 0.3)
#: Profiles, whether they are thin sheets, and places of stations.
CLEAR = [
    *((profile, False, (1, 0, 0.3, 0.6)) for profile in (WALLS, blazed(0.8, 0.1))),
    *((profile, False, (2, 1, 0.6, 0.5)) for profile in (WALLS, blazed(0.8, 0.1))),
    *((p, True, (2, 0, 0.3, 0.6)) for p in (WALLS, sinusoidal(0.8, 0.06), LEANING, T_SHAPED)),
]


@pytest.mark.parametrize(("profile", "thin", "place"), CLEAR)
def test_two_solvers_agree_on_dielectrics_in_conical_mounts(profile, thin, place):
    """Of sheets on light from above and from within."""
    w = [0.2] if thin else [0.2, 0.8]
    station = grating(profile, 1.58 if thin else 1.5, thin=thin).station(*place, w)
    integral = IntegralSolver(profile, 100).amplitudes(station)
    coupled = CoupledWaves(profile, 14).amplitudes(station)
    # phases too: 100 points are within 7e-3 of 200 or 400 (corners of the blaze and the T)
    assert np.abs(integral - coupled).max() < 8e-3
    if thin:
        assert len(station.inside) == 5
        # a clear material keeps all light; coupled waves do so to rounding
        assert np.allclose((np.abs(coupled) ** 2).sum(axis=(3, 4)), 1.0, atol=1e-6)
    else:
        # 90 points are within 4e-3 of 200, 12 harmonics within 2e-3 of 40
        assert np.abs(np.abs(integral) ** 2 - np.abs(coupled) ** 2).max() < 5e-3


def test_two_solvers_agree_on_walls_of_aluminium():
    profile = lamellar(0.7, 0.1)
    station = grating(profile, "Al", 1.5).station(2, 0, 0.4, 0.7, [0.5])
    integral = powers(IntegralSolver(profile, 130), station).sum(axis=-1)
    coupled = powers(CoupledWaves(profile, 40), station).sum(axis=-1)
    # coupled waves of TM on metal converge slowly: 0.5 % between 40 and 60 harmonics
    assert np.abs(integral - coupled).max() < 0.01


def test_a_perfect_conductor_reflects_all_light_whatever_the_wavelength():
    profile = sinusoidal(0.7, 0.1)
    solver, surface = IntegralSolver(profile, 120), grating(profile, "none")
    near, far = (powers(solver, surface.station(2, 0, 0.3, 0.5, [w])) for w in (0.1, 0.9))
    assert np.allclose(near, far, atol=1e-12)
    # 1.1e-3 at 60 points
    assert np.allclose(near.sum(axis=(3, 4)), 1, atol=5e-4)


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
