"""The model in one file: the default of `reference.brdf`, and twin of the matrices in `optics`."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics import blend
from mitsuba_diffraction.optics.geometry import sigma_of, wavenumber
from mitsuba_diffraction.reference import boundary, model
from tests.support.directions import rough_patch
from tests.support.matrices import pairs

FIELD = rough_patch((12, 15), (0.13, 0.15), 0.3)
WI, WO = (directions[::6] for directions in pairs())
LIGHT = model.Light(WI, WO, np.linspace(400.0, 700.0, len(WI)))
INDICES = [np.full(len(WI), n, complex) for n in (1.5, 0.8, 0.65 + 5.6j)]


@pytest.mark.parametrize("index", INDICES)
def test_matrices_are_those_of_the_tables(index):
    """`optics.boundary` writes B by fields at interfaces, which may have a film."""
    assert model.kirchhoff(LIGHT, index) == pytest.approx(boundary.kirchhoff(WI, WO, index))
    assert model.small_slope(LIGHT, index) == pytest.approx(boundary.small_slope(WI, WO, index))
    s = model.share(FIELD, LIGHT, index)
    total = wavenumber(LIGHT.wavelength)[:, None] * (WI + WO)
    variance = blend.ScaleRoughness.from_heights(FIELD.heights, FIELD.pixel_size).at(
        np.hypot(*total[:, :2].T)
    )
    assert s == pytest.approx(boundary.small_slope_weight(total[:, 2], variance, index))
    both = boundary.mixed(model.kirchhoff(LIGHT, index), model.small_slope(LIGHT, index), s)
    assert both == pytest.approx(boundary.blended(WI, WO, index, s))


def test_the_reference_s_default_is_the_model():
    light = {"eta": 1.5, "coherence_width": 2.0}
    found = reference.brdf(FIELD, WI, WO, LIGHT.wavelength, **light)
    expected = model.default_brdf(
        FIELD, LIGHT, INDICES[0], model.Sigmas(sigma_of(2.0), sigma_of(2.0))
    )
    assert np.array_equal(found, expected)
    matrices = reference.mueller(FIELD, WI, WO, LIGHT.wavelength, **light)
    assert matrices[:, 0, 0] == pytest.approx(found)


def test_small_slope_is_the_default_where_there_is_an_index():
    light = {"coherence_width": 2.0}
    pair = WI[:4], WO[:4], 550.0
    for material, name in (({"eta": 0.7, "k": 5.0}, "small_slope"), ({}, "kirchhoff")):
        default, told = (
            reference.brdf(FIELD, *pair, **light, **material, **model)
            for model in ({}, {"model": name})
        )
        assert np.array_equal(default, told)
    through = WI[:4], -WO[:4], 550.0
    assert np.array_equal(
        reference.btdf(FIELD, *through, eta=1.5),
        reference.btdf(FIELD, *through, eta=1.5, model="small_slope"),
    )
