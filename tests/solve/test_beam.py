"""Orders of some directions of light alone."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.fresnel import amplitudes as fresnel
from mitsuba_diffraction.solve.beam import solve_beam
from mitsuba_diffraction.solve.materials import material_of
from mitsuba_diffraction.solve.orders import Settings
from mitsuba_diffraction.solve.profiles import polygon, sinusoidal

#: One wavelength.
GREEN = Settings(wavelengths=(550.0, 550.0))


def test_a_flat_surface_reflects_s_and_p_of_conical_light_as_fresnel_says():
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_beam(sinusoidal(0.6, 1e-6), "Al", theta=40.0, phi=60.0, settings=GREEN)
    theta, phi = np.radians(40.0), np.radians(60.0)
    x, y = -np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    index = material_of("Al", GREEN.wavelengths).index(550.0)
    truth = np.abs(np.stack(fresnel(np.cos(theta), index))) ** 2
    # 10⁻³ nm of the depth; single precision
    np.testing.assert_allclose(table.polarised_efficiency(x, y, 550.0, 0), truth, atol=1e-4)


@pytest.mark.thorough
def test_an_echelle_sends_its_light_back_into_the_order_of_its_blaze():
    """R2, 79 lines/mm, aluminium: 2 d sin θ = m λ has m = 41 at 552 nm."""
    period, tangent = 1e3 / 79, 2.0
    width = period / (1.0 + tangent**2)
    echelle = polygon([(0, 0), (width, width * tangent)], period)
    theta = np.degrees(np.arctan(tangent))
    lam = 2e3 * period * np.sin(np.radians(theta)) / 41
    settings = Settings(wavelengths=(lam, lam), resolution=80)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_beam(echelle, "Al", theta=-theta, settings=settings)
    efficiency = table.polarised_efficiency(np.sin(np.radians(theta)), 0.0, lam, -41)
    # the facet is 41 half waves deep: most of R = 0.91 but for shadowed edges
    assert efficiency[0] > 0.6
    # its next resolution
    assert table.header["solver_error"] < 1e-3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"theta": 95.0}, "theta 95 must be"),
        ({"theta": np.arange(80), "phi": np.arange(80), "step": 0.1}, "choose fewer directions"),
        ({"theta": 10.0, "settings": Settings(polarised=True)}, "efficiencies alone"),
    ],
)
def test_light_that_cannot_be_solved_is_refused(options, message):
    with pytest.raises(DiffractionError, match=message):
        solve_beam(sinusoidal(0.6, 0.05), "Al", **options)
