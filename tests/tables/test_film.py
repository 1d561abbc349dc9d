"""The mean of the second order under a film, by angle and wavelength."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics import mean_second_order
from mitsuba_diffraction.optics.blend import ScaleRoughness
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.tables.film import exponents
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

RANGE = (400.0, 700.0)


def oxide(thickness, lam):
    depth = 2.0 * np.pi * thickness / np.asarray(lam)
    return Filmed(*np.broadcast_arrays(0.9 + 6.0j, 1.77 + 0.0j, depth))


@pytest.mark.parametrize("thickness", [100.0, 250.0])
def test_tables_have_it(thickness):
    """From the roughness of a table, between its nodes: of g, 1.3 % per direction up to 80°."""
    patch = rough_patch((40, 44), (0.09, 0.09), 0.14, 0.8)
    exact = ScaleRoughness.from_heights(patch.heights, patch.pixel_size)
    table = exponents(exact.table(4e3 * np.pi / RANGE[0]), lambda lam: oxide(thickness, lam), RANGE)
    theta = np.radians([5.0, 30.0, 55.0, 80.0])
    for lam in (437.0, 561.0, 643.0):
        wavenumber = 2e3 * np.pi / lam
        expected = mean_second_order.exponents(
            np.cos(theta), oxide(thickness, lam), exact, wavenumber
        )
        found = table.at(theta, 0.0 * theta, lam)
        assert found == pytest.approx(expected, abs=0.013)
        assert found[:2] == pytest.approx(expected[:2], abs=0.004)


def test_one_wavelength_is_one_page():
    patch = rough_patch((40, 44), (0.09, 0.09), 0.14, 0.8)
    roughness = ScaleRoughness.from_heights(patch.heights, patch.pixel_size).table(50.0)
    table = exponents(roughness, lambda lam: oxide(250.0, lam), (550.0, 550.0))
    assert table.values.shape[0] == 1
