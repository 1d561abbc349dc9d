"""A film's coefficients and its small-slope matrix: limits, symmetries, and another package's."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.reference import fresnel, model
from tests.support.matrices import MATRICES, pairs

MATERIALS = (1.5, 0.8, 0.65 + 5.6j)
FILMS = (1.45, 0.7, 2.4 + 0.1j)
DEPTHS = np.random.default_rng(4).uniform(0.1, 6.0, 300)


@pytest.mark.parametrize("index", MATERIALS)
@pytest.mark.parametrize("film", FILMS)
def test_flat_films_are_those_of_transfer_matrices(index, film):
    tmm = pytest.importorskip("tmm", reason="the extra `validation` has tmm")
    for theta, thickness in ((0.0, 80.0), (40.0, 300.0), (80.0, 900.0)):
        angle, wavelength = np.radians(theta), 550.0
        depth = 2 * np.pi * thickness / wavelength
        mine = fresnel.amplitudes(np.cos(angle), Filmed(index, film, depth))
        for light, r in zip("sp", mine, strict=True):
            stack = [1.0, film, index], [np.inf, thickness, np.inf]
            theirs = tmm.coh_tmm(light, *stack, angle, wavelength)
            assert abs(r) ** 2 == pytest.approx(theirs["R"], abs=1e-12)


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


def test_elements_are_those_of_all_parts():
    one = Filmed(np.array([1.5, 1.6]), 1.4, np.array([2.0, 3.0]))[1]
    wi, wo = (a[:1] for a in pairs())
    found = model.small_slope(wi, wo, one)
    assert found == pytest.approx(model.small_slope(wi, wo, Filmed(1.6, 1.4, 3.0)))
