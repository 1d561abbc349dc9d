"""The whole spectrum: against the reference integral and sums written out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods.method import trapezoid_rule
from tests.directions import lit_pairs, uniform_directions
from tests.thesis.methods.conftest import WIDTH


@pytest.mark.parametrize(("name", "coherence"), [("default", "ensemble"), ("flss", "patch")])
def test_one_wavelength_is_the_reference(rough, of_rough, name, coherence):
    wi, wo, wavelength, _ = lit_pairs(rough, sigma_of(WIDTH), 160, seed=3)
    keep = wavelength >= 380.0
    wi, wo, wavelength = wi[keep], wo[keep], wavelength[keep]
    exact = reference.brdf(rough, wi, wo, wavelength, coherence_width=WIDTH, coherence=coherence)
    found = of_rough[name].brdf(wi, wo, wavelength)
    # the tolerance of the tables, 1e-3, is on this sum at the worst κ
    assert np.abs(found - exact).sum() <= 1e-3 * exact.sum()


def test_flss_can_average_over_the_windows_too(rough):
    wi, wo, wavelength, _ = lit_pairs(rough, sigma_of(WIDTH), 80, seed=4)
    wavelength = np.maximum(wavelength, 380.0)
    method = methods.make("flss", rough, coherence_width=WIDTH, coherence="ensemble")
    exact = reference.brdf(rough, wi, wo, wavelength, coherence_width=WIDTH)
    found = method.brdf(wi, wo, wavelength)
    assert np.abs(found - exact).sum() <= 1e-3 * exact.sum()


def test_colours_are_the_trapezoidal_sum_of_the_reference(rough):
    rng = np.random.default_rng(1)
    wi, wo = uniform_directions(6, rng, 0.4), uniform_directions(6, rng, 0.4)
    method = methods.make(
        "flss", rough, coherence_width=WIDTH, wavelength_range=(400.0, 700.0), step=50.0
    )
    expected = np.zeros((6, 3))
    for n, lam in enumerate(range(400, 701, 50)):
        weight = 25.0 if n in (0, 6) else 50.0
        f = reference.brdf(rough, wi, wo, lam, coherence_width=WIDTH, coherence="patch")
        expected += weight * f[:, None] * response(lam)
    # the tolerance of the table on each pair's own light, most of it far from the brightest order
    np.testing.assert_allclose(method.xyz(wi, wo), expected, rtol=1e-2)
    assert np.abs(method.xyz(wi, wo) - expected).sum() < 1e-3 * expected.sum()


@given(st.floats(200.0, 500.0), st.floats(1.0, 400.0), st.floats(0.1, 100.0))
def test_the_trapezoidal_rule_covers_the_range(low, length, step):
    nodes, weights = trapezoid_rule((low, low + length), min(step, 0.99 * length))
    assert nodes[0] == low
    assert nodes[-1] == pytest.approx(low + length, rel=1e-8)
    assert np.all(np.diff(nodes) <= step * (1 + 1e-9))
    # exact for straight lines
    assert weights.sum() == pytest.approx(length, rel=1e-8)
    assert weights @ nodes == pytest.approx(0.5 * ((low + length) ** 2 - low**2), rel=1e-8)
