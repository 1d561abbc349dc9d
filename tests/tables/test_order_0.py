"""Order 0 has the window of the light, and a scan limits the window of all other orders."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.heights.coherence import LOOKUP
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from tests.support.directions import lit_pairs, polar
from tests.support.patches import SMALL_SCAN, relative_error

LAMP = polar(30.0, 180.0)
#: Settings of tables that are quick to build.
FAST = {"height_scale_max": 1.0, "wavelength_range": (440.0, 810.0)}


def beside_the_mirror(table, degrees, wavelengths):
    """Reflectance over that of white for a detector of 2° beside the mirror direction."""
    n = np.arange(600)
    radius, turn = np.radians(1.0) * np.sqrt((n + 0.5) / n.size), 2.399963 * n  # even over the disc
    sin, cos = np.sin(np.radians(30.0 + degrees)), np.cos(np.radians(30.0 + degrees))
    axes = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0]])
    wo = np.array([sin, 0.0, cos]) * np.cos(radius)[:, None]
    wo += (np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.sin(radius)[:, None]) @ axes
    each = [(table.brdf(LAMP, wo, lam) * wo[:, 2]).mean() for lam in wavelengths]
    return np.pi * np.array(each) / cos


@pytest.mark.parametrize("width", [1.0, 2.0, 5.0, 10.0, 30.0, 65.0])
def test_beside_the_mirror_of_a_flat_scan_is_no_light(width):
    noise = 1e-6 * np.random.default_rng(1).standard_normal((16, 16))  # µm: it limits the window
    scan = md.HeightField(noise, width / 16, cut_out=True)
    table = md.DiffractionTable.build(scan, **FAST)
    assert table.window_width == min(width, max(32.0, width / 2))
    for degrees in (3.0, 5.0, 10.0, 30.0):
        # the lobe of sunlight, 0.6° wide in red light, ends there
        assert beside_the_mirror(table, degrees, (450.0, 600.0, 800.0)).max() < 1e-3


def test_the_window_of_the_light_changes_order_0_alone():
    table = md.DiffractionTable.build(SMALL_SCAN)
    assert (table.coherence_width, table.window_width) == (65.0, min(SMALL_SCAN.extent))
    one = md.DiffractionTable.build(SMALL_SCAN, coherence_width=table.window_width)
    # the look-up's σ_l is LOOKUP times that of the light, whose lobe the taper makes up for
    assert one.order_0_ratio == pytest.approx(LOOKUP**-2, rel=1e-12)
    np.testing.assert_array_equal(table.coefficients, one.coefficients)
    q, kappa = np.array([0.0, 0.03, 0.1, 0.5, 2.0]), 20.0
    order_0 = one.order_0_at(kappa)[0]
    expected = one.window_sum(q, 0.0, kappa)
    expected -= order_0 * one.order_0_ratio * np.exp(-((one.sigma_0 * q) ** 2))
    ratio = (table.sigma_0 / table.sigma) ** 2
    expected += order_0 * ratio * np.exp(-((table.sigma_0 * q) ** 2))
    # differences of larger numbers
    np.testing.assert_allclose(table.window_sum(q, 0.0, kappa), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("basis", ["svd", "chebyshev"])
def test_tables_of_a_small_scan_meet_their_tolerance(basis):
    table = md.DiffractionTable.build(SMALL_SCAN, basis=basis)
    near, far = relative_error(table, SMALL_SCAN)
    assert max(near, far) < table.tolerance
    # the lobe of the light, in which no pair above need lie
    wi, wo, lam, close = lit_pairs(SMALL_SCAN, table.sigma_0, 80, 3)
    exact = md.reference.brdf(SMALL_SCAN, wi, wo, lam)
    difference = np.abs(table.brdf(wi, wo, lam) - exact) / kirchhoff_factor(wi, wo, lam, 1.0)
    scale = exact / kirchhoff_factor(wi, wo, lam, 1.0)
    assert difference[close].sum() < table.tolerance * scale[close].sum()


def test_where_order_0_is_dark_all_light_is_a_number():
    """A sinusoid of amplitude a has no order 0 at κa = 2.4048, where a series may be below 0."""
    wave = 0.2 * np.sin(2.0 * np.pi * np.arange(40) / 40) * np.ones((4, 1))
    field = md.HeightField(wave, 0.05, periodic=True)
    table = md.DiffractionTable.build(field, coherence_width=3.0, tolerance=0.1, basis="chebyshev")
    kappa = np.linspace(2.3, 2.5, 400) / 0.2
    assert table.order_0_at(kappa).min() < 0.0  # there is such light
    wi, up = polar(20.0, 0.0), np.array([0.0, 0.0, 1.0])
    wavelength = 2e3 * np.pi * (wi + up)[2] / kappa
    assert np.all(table.brdf(wi, up, wavelength) >= 0.0)
