"""Maps that cannot be made are refused in one line."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, HeightField
from mitsuba_diffraction.analysis.maps import brdf_map
from tests.support.mapped import plugin

# Patches here are small and tiled, and the flat ones coarse: the warnings are right, but known.
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize(
    ("asked", "text"),
    [
        ({"theta": 90.0}, "theta=90 must be at least 0 and below 90"),
        ({"theta": -1.0}, "theta=-1"),
        ({"theta": float("nan")}, "theta=nan"),
        ({"phi": 361.0}, "phi=361 must be from -360 to 360"),
        ({"wavelength_range": (700.0, 400.0)}, "700 to 400 nm is empty"),
        ({"wavelength_range": (0.0, 400.0)}, "0 to 400 nm is empty"),
        ({"wavelength": float("inf")}, "inf to inf nm is empty"),
        ({"wavelength_range": (300.0, 830.0)}, "table's shortest wavelength, 360 nm"),
        ({"step": 471.0}, "step=471 nm does not fit the range of 360 to 830 nm"),
        ({"step": 0.0}, "step=0 nm"),
        ({"step": float("nan")}, "step=nan nm"),
        ({"resolution": 7}, "resolution=7 must be from 8 to 4096"),
        ({"resolution": 10**9}, "resolution=1000000000 must be"),
        ({"samples": 0}, "samples=0 must be from 1 to 1024"),
        ({"illuminant": "A"}, "illuminant='A' is unknown"),
        ({"resolution": 4096, "spectral": True}, "requires 6 GB"),
    ],
)
def test_what_does_not_fit_is_refused(asked, text):
    bsdf = plugin(HeightField(np.zeros((2, 2)), 32.5))
    with pytest.raises(DiffractionError) as caught:
        brdf_map(bsdf, **asked)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_variant_without_wavelengths_is_refused():
    mi.set_variant("scalar_rgb")
    with pytest.raises(DiffractionError, match="variant 'scalar_rgb' does not support maps"):
        brdf_map(mi.load_dict({"type": "diffuse"}))


@pytest.mark.parametrize(
    "asked",
    [
        {"wavelength": 550.0},
        {"wavelength_range": (400, 700)},
        {"spectral": True},
        {"illuminant": "E"},
    ],
)
def test_an_rgb_variant_has_no_other_light(some_variant, asked):
    mi.set_variant(some_variant.replace("spectral", "rgb"))
    with pytest.raises(DiffractionError, match="whole spectrum in daylight"):
        brdf_map(mi.load_dict({"type": "diffuse"}), resolution=8, **asked)
    mi.set_variant(some_variant)
