"""Polarisation of solved orders against closed forms that no solver here made."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.boundary import mueller, polarisation_axes, small_slope, turn
from mitsuba_diffraction.solve.coupled import CoupledWaves
from mitsuba_diffraction.solve.integral import IntegralSolver
from mitsuba_diffraction.solve.materials import material_of
from mitsuba_diffraction.solve.profiles import lamellar, sinusoidal
from mitsuba_diffraction.solve.stations import Grating
from mitsuba_diffraction.tables.orders.polarised import mueller_of

pytest.importorskip("gratinglab")

RANGE = (400.0, 700.0)


def axis(direction, y):
    """Direction of the grooves, made perpendicular to the light."""
    across = np.array([0.0, 1.0, 0.0]) - y * direction
    return across / np.linalg.norm(across)


@pytest.mark.parametrize("material", [1.5, "Al"])
@pytest.mark.parametrize("solver", [IntegralSolver, CoupledWaves])
def test_shallow_gratings_polarise_as_the_small_slope_model_says(solver, material):
    shallow = lamellar(0.8, 4e-4, 0.3) if solver is CoupledWaves else sinusoidal(0.8, 1e-3)
    grating = Grating(shallow, material_of(material, RANGE), 1.0, RANGE)
    station = grating.station(2, 0, 0.3, 0.6, [0.4])
    resolution = 80 if solver is IntegralSolver else 25
    found = mueller_of(solver(shallow, resolution).amplitudes(station)[0])
    y, c = station.along[0], np.sqrt(1 - station.along[0] ** 2)
    x, z = c * station.sines, c * np.sqrt(1 - station.sines**2)
    for j in range(station.channels):
        wi = np.array([-x[j], -y, z[j]])
        for q in range(max(j - 1, 0), min(j + 2, station.channels)):
            wo = np.array([x[q], y, z[q]])
            s_in, s_out = polarisation_axes(wi, wo)
            before, after = turn(s_in, axis(-wi, y), -wi), turn(axis(wo, y), s_out, wo)
            expected = mueller(after @ small_slope(wi, wo, station.indices[0]) @ before)
            ratio = found[j, q] / found[j, q, 0, 0], expected / expected[0, 0]
            assert np.abs(ratio[0] - ratio[1]).max() < 1, (ratio, j, q)
            print(j, q, found[j, q, 0, 0], np.abs(ratio[0] - ratio[1]).max())
