"""A film's coefficients and its small-slope matrix: limits, symmetries, and another package's."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.reference import boundary, fresnel, model
from tests.support.directions import polar
from tests.support.matrices import MATRICES, REVERSED, pairs

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
@pytest.mark.parametrize("film", FILMS)
@pytest.mark.parametrize("matrix", MATRICES)
def test_in_the_mirror_direction_it_is_the_flat_film_s(matrix, index, film):
    wi, _ = pairs()
    filmed = Filmed(index, film, DEPTHS)
    r_s, r_p = fresnel.amplitudes(wi[:, 2], filmed)
    found = matrix(wi, wi * [-1, -1, 1], filmed)
    expected = np.stack([r_s, 0 * r_s, 0 * r_s, r_p], -1).reshape(-1, 2, 2)
    assert found == pytest.approx(expected, abs=1e-12)  # rounding


@pytest.mark.parametrize("index", MATERIALS)
@pytest.mark.parametrize("film", FILMS)
@pytest.mark.parametrize("matrix", MATRICES)
def test_reciprocity(matrix, index, film):
    wi, wo = pairs()
    there, back = (matrix(*pair, Filmed(index, film, DEPTHS)) for pair in ((wi, wo), (wo, wi)))
    scale = np.abs(there).max()
    assert back == pytest.approx(REVERSED * np.swapaxes(there, -1, -2), abs=1e-13 * scale)


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


#: M/M₀₀ of orders 1 and −1 of a sinusoid of 2.5/0.04 µm, index 1.56 under 100 nm of 2.4, 550 nm,
#: light at 50° and −30° from x, by coupled waves: grcwa 0.1.2 (31 orders, 24 layers, both faces).
CONICAL = {
    1: [
        [1.0, 0.474, 0.1406, 0.0133],
        [0.4822, 0.8796, 0.4575, 0.07],
        [0.1102, 0.4527, -0.7246, -0.1937],
        [-0.0011, -0.0384, 0.2019, -0.8445],
    ],
    -1: [
        [1.0, 0.799, -0.143, 0.0247],
        [0.7757, 0.9197, -0.2999, -0.0807],
        [-0.2369, -0.3381, -0.3076, -0.4332],
        [0.04, 0.137, 0.42, -0.3833],
    ],
}


@pytest.mark.parametrize("order", CONICAL)
def test_between_the_planes_of_incidence_it_is_what_coupled_waves_say(order):
    wi = polar(50, -30)
    x, y = order * 0.55 / 2.5 - wi[0], -wi[1]
    wo = np.array([x, y, np.sqrt(1 - x * x - y * y)])
    filmed = Filmed(1.56, 2.4, 2 * np.pi * 100 / 550)
    found = boundary.mueller(model.small_slope(wi, wo, filmed))
    # the grating has a depth, its staircase some more
    assert found / found[0, 0] == pytest.approx(np.array(CONICAL[order]), abs=0.012)


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
