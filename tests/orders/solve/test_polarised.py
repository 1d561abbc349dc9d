"""Polarisation of solved orders against closed forms that no solver here made."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.orders.polarised import mueller_of
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.integral import IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import sinusoidal
from mitsuba_diffraction.orders.solve.stations import Grating
from mitsuba_diffraction.reference.boundary import mueller
from mitsuba_diffraction.reference.model import small_slope
from tests.support.orders import groove_matrices

pytest.importorskip("gratinglab")

RANGE = (400.0, 700.0)


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
