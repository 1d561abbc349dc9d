"""The model in one file, as the default of `reference.brdf`, and materials in all models."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import reference
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.reference import boundary, model
from tests.support.directions import polar, rough_patch
from tests.support.matrices import pairs

FIELD = rough_patch((12, 15), (0.13, 0.15), 0.3)
WI, WO = (directions[::6] for directions in pairs())
LIGHT = model.Light(WI, WO, np.linspace(400.0, 700.0, len(WI)))
INDICES = [np.full(len(WI), n, complex) for n in (1.5, 0.8, 0.65 + 5.6j)]
KERATIN, ALUMINIUM = {"eta": 1.56}, {"eta": 0.65, "k": 5.6}


@pytest.mark.parametrize("index", INDICES)
def test_fields_at_a_bare_interface_make_the_matrix_of_equation_8(index):
    """In the form in which first-order small slope is published; a film has more fields."""
    (x0, y0, _), (x, y, _) = (axis.T for axis in boundary.polarisation_axes(WI, WO))
    dot, cross = x0 * x + y0 * y, x0 * y - y0 * x
    (t0, q0), (t, q) = ((np.hypot(w[:, 0], w[:, 1]), w[:, 2]) for w in (WI, WO))
    epsilon = index * index
    inside0, inside = (np.sqrt(epsilon - sine**2) for sine in (t0, t))
    s0, s, p0, p = q0 + inside0, q + inside, epsilon * q0 + inside0, epsilon * q + inside
    pp = (inside * inside0 * dot - epsilon * t * t0) / (p * p0)
    expected = [[-dot / (s * s0), inside0 * cross / (s * p0)], [inside * cross / (p * s0), pp]]
    found = np.moveaxis(model.small_slope(WI, WO, index), 0, -1)
    assert found == pytest.approx((epsilon - 1.0) * np.array(expected))


def test_the_reference_s_default_is_the_model():
    light = {"eta": 1.5, "coherence_width": 2.0}
    found = reference.brdf(FIELD, WI, WO, LIGHT.wavelength, **light)
    expected = model.default_brdf(
        FIELD, LIGHT, INDICES[0], reference.Sigmas(sigma_of(2.0), sigma_of(2.0))
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


@pytest.mark.parametrize("coat", [None, 1.58])
@pytest.mark.parametrize("model", reference.MODELS)
def test_the_first_entry_of_the_mueller_matrix_is_the_brdf(model, coat):
    wi, wo = polar(50, 30), polar(35, 100)
    matrix = reference.mueller(FIELD, wi, wo, 520.0, model=model, coat=coat, **ALUMINIUM)
    found = reference.brdf(FIELD, wi, wo, 520.0, model=model, coat=coat, **ALUMINIUM)
    assert matrix.shape == (1, 4, 4)
    assert matrix[:, 0, 0] == pytest.approx(found, rel=1e-12)


def test_below_the_surface_there_is_no_light_in_any_model():
    below = np.array([0.6, 0.0, -0.8])
    for coherence in reference.COHERENCES:
        for pair in ((polar(30), below), (below, polar(30)), (below, below)):
            assert reference.brdf(FIELD, *pair, 520.0, coherence=coherence) == 0.0
    for name in reference.MODELS:
        assert reference.brdf(FIELD, polar(30), below, 520.0, model=name, **KERATIN) == 0.0
        assert np.all(reference.mueller(FIELD, below, polar(3), 520.0, model=name, **KERATIN) == 0)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"model": "small_slope"}, "eta"),
        ({"eta": 0.0}, "eta"),
        ({"eta": np.nan}, "eta"),
        ({"eta": 1.5, "k": -1.0}, "k="),
        ({"eta": [1.5, 1.6]}, "eta"),
    ],
)
def test_a_model_or_index_that_is_none_is_refused(arguments, word):
    with pytest.raises(DiffractionError, match=word):
        reference.brdf(FIELD, polar(30), polar(10), 520.0, **arguments)
