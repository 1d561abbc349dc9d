"""Fresnel's coefficients, bare and of a film: known values, limits, and other packages' own."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.reference import fresnel
from tests.support.matrices import MATRICES, pairs

COSINES = np.cos(np.radians([0.0, 20.0, 45.0, 70.0, 89.0]))
MATERIALS = (1.5, 0.8, 0.65 + 5.6j)
FILMS = (1.45, 0.7, 2.4 + 0.1j)
DEPTHS = np.random.default_rng(4).uniform(0.1, 6.0, 300)


def test_it_is_what_mitsuba_computes(some_variant):
    import mitsuba as mi

    cosine = COSINES.astype(np.float32)
    for index in (1.56, 1.004 + 6.807j, 0.6 + 2.0j):
        n = complex(index)
        if n.imag == 0:
            theirs = [mi.fresnel(mi.Float(float(c)), n.real)[0] for c in cosine]
        else:
            theirs = [mi.fresnel_conductor(mi.Float(float(c)), mi.Complex2f(n.real, n.imag))
                      for c in cosine]  # fmt: skip
        values = np.array([np.array(value).item() for value in theirs])
        # Mitsuba's single precision
        assert fresnel.reflectance(cosine, n) == pytest.approx(values, abs=2e-6)


@pytest.mark.parametrize("index", MATERIALS)
@pytest.mark.parametrize("matrix", MATRICES)
def test_films_that_are_none_leave_the_surface_bare(matrix, index):
    wi, wo = pairs()
    bare = matrix(wi, wo, index)
    scale = np.abs(bare).max()
    for none in (Filmed(index, 1.8, 0.0), Filmed(index, index, DEPTHS)):
        assert matrix(wi, wo, none) == pytest.approx(bare, abs=1e-13 * scale)
    # of the medium above: the surface lies deeper, by κ times the depth
    phase = np.exp(1j * (wi[:, 2] + wo[:, 2]) * DEPTHS)[:, None, None]
    found = matrix(wi, wo, Filmed(index, 1.0, DEPTHS))
    assert found == pytest.approx(bare * phase, abs=1e-12 * scale)


def test_no_film_reflects_more_than_it_gets():
    cosines = np.linspace(0.01, 1.0, 50)[:, None]
    for index in MATERIALS:
        for film in FILMS:
            assert fresnel.reflectance(cosines, Filmed(index, film, DEPTHS)).max() <= 1.0 + 1e-12
