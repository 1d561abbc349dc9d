"""Bands fill their range; a map knows how bright to show it and whether it has colours."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.analysis.maps import Bands, brdf_map
from tests.support.mapped import GRATING, mirror, plugin


@given(st.floats(0.1, 500), st.floats(300, 500), st.floats(0.1, 500))
def test_bands_fill_the_range_and_are_no_wider_than_the_step(step, low, extent):
    extent = (low + extent) - low  # as rounding leaves it
    if step > extent:
        with pytest.raises(DiffractionError, match="step="):
            Bands(low, low + extent, step)
        return
    bands = Bands(low, low + max(extent, 1.000001 * step), step)
    assert bands.width <= step * (1 + 1e-9)
    np.testing.assert_allclose(bands.wavelengths(0.0)[0], low)
    np.testing.assert_allclose(bands.wavelengths(1.0)[-1], bands.high)


def test_five_nanometres_are_ninety_four_bands():
    assert Bands(360, 830).count == 94
    assert Bands(380, 780, 0.1).count == 4000  # not one more by rounding


# Patches here are small and tiled, and the flat ones coarse: the warnings are right, but known.
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")


@pytest.mark.usefixtures("variant")
def test_exposure_shows_what_lies_around_the_mirror_direction():
    result = brdf_map(plugin(GRATING), 20.0, step=47, resolution=128)
    stops = result.exposure()
    shown = np.sort((result.luminance * 2.0**stops)[result.away_from_mirror()].astype(float))
    below_white = shown[shown < 1.0].sum() / shown.sum()
    assert below_white >= 0.45  # rounded to a tenth of a stop
    assert (result.luminance * 2.0**stops > 8.6).mean() <= 1e-3
    alone = brdf_map(mirror(), 20.0, step=47, resolution=64)  # nothing but the lobe: it counts
    assert alone.luminance.max() * 2.0 ** alone.exposure() > 1.0
    dark = brdf_map(mi.load_dict({"type": "dielectric"}), resolution=8)  # specular only
    assert dark.exposure() == 0.0


@pytest.mark.usefixtures("variant")
def test_a_single_wavelength_has_no_colours():
    result = brdf_map(mirror(), wavelength=550.0, resolution=16)
    assert result.xyz is None
    assert result.albedo().shape == (1,)
    with pytest.raises(ValueError, match="no colours"):
        _ = result.linear
