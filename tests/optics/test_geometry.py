"""Geometry: diffraction coordinates and the factors outside the integral."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.optics.geometry import (
    diffraction_coordinates,
    kirchhoff_factor,
    sigma_of,
    wavenumber,
)
from tests.support.directions import polar

angles = st.tuples(st.floats(0.0, 89.9), st.floats(-180.0, 180.0))


def test_the_window_s_width_is_four_standard_deviations():
    assert sigma_of(65.0) == 16.25


def test_wavenumbers_are_per_micrometre_for_nanometres():
    assert wavenumber(500.0) == pytest.approx(2 * np.pi / 0.5, rel=1e-15)  # rounding
    assert wavenumber([400.0, 800.0]).shape == (2,)


def test_coordinates_are_the_sum_of_the_directions():
    wi, wo = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, -0.6, 0.8]])
    u, v, w = diffraction_coordinates(wi, wo)
    assert (u[0], v[0], w[0]) == (0.6, -0.6, 1.6)


@given(angles, angles, st.floats(360.0, 830.0))
def test_the_factor_is_positive_symmetric_and_as_written(incident, outgoing, lam):
    wi, wo = polar(*incident), polar(*outgoing)
    factor = kirchhoff_factor(wi, wo, lam, 3.0)
    # the order of multiplication: a few units in the last place
    assert factor == pytest.approx(kirchhoff_factor(wo, wi, lam, 3.0), rel=1e-15)
    plain = (1 + wi @ wo) ** 2 / (
        (lam * 1e-3) ** 2 * np.pi * 9.0 * (wi[2] + wo[2]) ** 2 * wi[2] * wo[2]
    )
    assert factor > 0
    # the plain form itself loses digits as ωi·ωo → −1, at worst 2e-16/3e-6 at two times 89.9°
    assert factor == pytest.approx(plain, rel=4e-10)


def test_opposite_grazing_directions_keep_their_precision():
    # towards the mirror direction 1 + ωi·ωo is 2cos²θ
    theta = 89.999
    cos = np.cos(np.radians(theta))
    factor = kirchhoff_factor(polar(theta, 0), polar(theta, 180), 500.0, 1.0)
    exact = (2 * cos**2) ** 2 / (0.25 * np.pi * (2 * cos) ** 2 * cos**2)
    assert factor == pytest.approx(exact, rel=1e-10)  # cos itself is known to 1e-16/2e-5


@pytest.mark.parametrize("below", [polar(95, 10), polar(90.001, 0), polar(180)])
def test_there_is_nothing_below_the_surface(below):
    above = polar(30)
    assert kirchhoff_factor(above, below, 500.0, 1.0) == 0
    assert kirchhoff_factor(below, above, 500.0, 1.0) == 0
    assert kirchhoff_factor(below, below, 500.0, 1.0) == 0
