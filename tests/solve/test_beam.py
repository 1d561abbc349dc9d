"""Orders of some directions of light alone."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.reference.fresnel import amplitudes as fresnel
from mitsuba_diffraction.solve.beam import solve_beam
from mitsuba_diffraction.solve.materials import material_of
from mitsuba_diffraction.solve.orders import Settings
from mitsuba_diffraction.solve.profiles import sinusoidal

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
