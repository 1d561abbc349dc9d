"""The reference of materials: Fresnel's share, polarisation, and light diffracted twice."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import reference
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.reference import fresnel
from tests.support.directions import polar, rough_patch

#: Odd and even numbers of pixels, not square, nor are the pixels; 1.95 × 1.8 µm.
SMALL = rough_patch((12, 15), (0.13, 0.15), 0.3)
#: Well below 1/2 of the patch, so that several lobes overlap; σ in µm.
SIGMA = 0.45

KERATIN, ALUMINIUM = {"eta": 1.56}, {"eta": 0.65, "k": 5.6}


@pytest.mark.parametrize("material", [KERATIN, ALUMINIUM])
@pytest.mark.parametrize("model", reference.MODELS)
def test_the_brdf_of_a_material_is_reciprocal(model, material):
    wi, wo = polar(65, 20), polar(25, 150)
    there = reference.brdf(SMALL, wi, wo, 520.0, coherence_width=3.0, model=model, **material)
    back = reference.brdf(SMALL, wo, wi, 520.0, coherence_width=3.0, model=model, **material)
    assert there[0] > 0
    assert back == pytest.approx(there, rel=1e-10)


@pytest.mark.parametrize("model", reference.MODELS)
def test_in_the_mirror_direction_it_is_fresnel_s_share_of_the_perfect_reflector(model):
    wi, wo = polar(50, 30), polar(50, 210)
    perfect = reference.brdf(SMALL, wi, wo, 520.0)
    share = fresnel.reflectance(wi[2], 0.65 + 5.6j)
    found = reference.brdf(SMALL, wi, wo, 520.0, model=model, **ALUMINIUM)
    assert found == pytest.approx(share * perfect, rel=1e-10)


@pytest.mark.parametrize("coat", [None, 1.58])
@pytest.mark.parametrize("model", reference.MODELS)
def test_the_first_entry_of_the_mueller_matrix_is_the_brdf(model, coat):
    wi, wo = polar(50, 30), polar(35, 100)
    matrix = reference.mueller(SMALL, wi, wo, 520.0, model=model, coat=coat, **ALUMINIUM)
    found = reference.brdf(SMALL, wi, wo, 520.0, model=model, coat=coat, **ALUMINIUM)
    assert matrix.shape == (1, 4, 4)
    assert matrix[:, 0, 0] == pytest.approx(found, rel=1e-12)


def test_below_the_surface_there_is_no_light_in_any_model():
    below = np.array([0.6, 0.0, -0.8])
    for model in reference.MODELS:
        assert reference.brdf(SMALL, polar(30), below, 520.0, model=model, **KERATIN) == 0.0
        assert np.all(reference.mueller(SMALL, below, polar(3), 520.0, model=model, **KERATIN) == 0)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"model": "rice", "eta": 1.5}, "small_slope, kirchhoff"),
        ({"model": "small_slope"}, "eta"),
        ({"eta": 0.0}, "eta"),
        ({"eta": np.nan}, "eta"),
        ({"eta": 1.5, "k": -1.0}, "k="),
        ({"eta": [1.5, 1.6]}, "eta"),
    ],
)
def test_a_model_or_index_that_is_none_is_refused(arguments, word):
    with pytest.raises(DiffractionError, match=word):
        reference.brdf(SMALL, polar(30), polar(10), 520.0, **arguments)
