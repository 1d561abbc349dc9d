"""Scatter of rough mirrors, beside closed forms and the model's table."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import (
    DiffractionError,
    DiffractionTable,
    DiffractionWarning,
    HeightField,
    gratings,
)
from mitsuba_diffraction.heights.scatter import abg_model, power_spectrum, rayleigh_rice_scatter
from mitsuba_diffraction.tables.powers import order_0_power


def test_slow_roughness_scatters_as_the_square_of_its_height():
    """TIS = (4πσ/λ)² (Bennett and Porteus 1961) where all scatter is near the mirror direction."""
    field = gratings.rough(200.0, 128, rms=0.002, band=(20.0, 100.0))
    expected = (4 * np.pi * 0.002 / 0.6328) ** 2
    assert rayleigh_rice_scatter(field, 632.8).share == pytest.approx(expected, rel=1e-3)


def test_a_shallow_sinusoid_s_orders_follow_from_rayleigh_and_rice():
    """Two orders of (2πa/λ)² cosθ each, a the amplitude, θ their angle."""
    field = gratings.sinusoidal(period=2.0, depth=0.004, periods=8, rows=8)
    cosine = np.sqrt(1 - (0.6328 / 2.0) ** 2)
    expected = 2 * (2 * np.pi * 0.002 / 0.6328) ** 2 * cosine
    assert rayleigh_rice_scatter(field, 632.8).share == pytest.approx(expected, rel=1e-3)


def test_the_table_s_scatter_is_that_of_rayleigh_and_rice():
    field = gratings.rough(40.0, 192, rms=0.003, band=(4.0, 20.0))
    table = DiffractionTable.build(field, coherence_width=10.0, wavelength_range=(630.0, 640.0))
    scatter = 1.0 - float(order_0_power(table, 4e3 * np.pi / 632.8))
    # the table is scalar, without cosines (5 %), and has heights in all powers
    assert scatter == pytest.approx(rayleigh_rice_scatter(field, 632.8).share, rel=0.05)


def test_an_abg_model_is_found_again():
    """K-correlation with C = 1 is an ABg model with g = 2 and B = (λ/2πl)²."""
    field = gratings.rough(240.0, 768, rms=0.003, correlation=1.0, slope=1.0)
    model = abg_model(power_spectrum(field), 632.8)
    assert model.g == pytest.approx(2.0, abs=0.15)
    assert model.b == pytest.approx((0.6328 / (2 * np.pi)) ** 2, rel=0.1)
    assert model.error < 0.1
    with pytest.raises(DiffractionError, match="the model needs"):
        abg_model(power_spectrum(HeightField(np.eye(8) * 0.01, 0.2)), 632.8)
    with pytest.raises(DiffractionError, match="flat"):
        abg_model(power_spectrum(HeightField(np.zeros((24, 24)), 0.1)), 632.8)


def test_heights_that_are_not_far_below_the_wavelength_are_named():
    with pytest.warns(DiffractionWarning, match="Rayleigh-Rice"):
        rayleigh_rice_scatter(gratings.sinusoidal(period=2.0, depth=0.4, periods=2), 632.8)
