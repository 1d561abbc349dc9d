"""Fresnel's coefficients, bare, of films and of stacks: limits, and other packages' own."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.optics.stack import amplitudes, mean_powers
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


TILTED = np.cos(np.radians([0.0, 20, 45, 70, 88]))
LAM = np.array([400.0, 550, 700])
#: Gold, then a high, a low and an absorbing index upwards; nm.
INDICES = np.array([0.3 + 2.5j, 2.3, 1.38, 1.6 + 0.05j])[:, None] * np.ones(3)
THICK = np.array([60.0, 130.0, 90.0])


def test_a_mean_over_a_spread_is_the_integral_over_a_gaussian_of_thicknesses():
    cosine, lam, spread = np.array([0.3, 0.9]), np.array([450.0, 640.0]), 0.1
    indices = np.array([[0.9 + 6.0j] * 2, [1.5] * 2, [2.3 + 0.01j] * 2, [1.4] * 2])
    thicknesses = np.array([90.0, 60.0, 110.0])
    found = mean_powers(cosine, lam, indices, thicknesses, spread)
    places = np.linspace(-5.0, 5.0, 101)
    weights = np.exp(-0.5 * places**2) / np.exp(-0.5 * places**2).sum()
    expected = np.zeros_like(found)
    for place, weight in zip(places, weights, strict=True):
        s, p = amplitudes(cosine, lam, indices, (1.0 + spread * place) * thicknesses)
        expected += weight * np.stack([np.abs(s) ** 2, np.abs(p) ** 2, p * s.conj()], axis=-1)
    assert np.abs(expected[..., 2].imag).min() > 0.01
    # the mean ends at three standard deviations
    np.testing.assert_allclose(found, expected, atol=3e-3)


def test_reflection_is_that_of_transfer_matrices():
    tmm = pytest.importorskip("tmm")
    r_s, r_p = amplitudes(TILTED, LAM, INDICES, THICK)
    depths = [np.inf, *THICK[::-1], np.inf]
    for n, lam in enumerate(LAM):
        for m, cosine in enumerate(TILTED):
            column = [1.0, *INDICES[::-1, n]]
            r = [tmm.coh_tmm(p, column, depths, np.arccos(cosine), lam)["r"] for p in "sp"]
            # rounding
            assert [r_s[n, m], r_p[n, m]] == pytest.approx(r, abs=1e-9)


@pytest.mark.parametrize("film", [1.45, 0.7, 2.4 + 0.1j])
@pytest.mark.parametrize("index", [1.5, 0.8, 0.65 + 5.6j])
def test_one_layer_is_a_film(index, film):
    got = amplitudes(TILTED, LAM, np.outer([index, film], np.ones(3)), THICK[:1])
    for n, lam in enumerate(LAM):
        filmed = Filmed(index, film, 2 * np.pi * THICK[0] / lam)
        expected = reference.fresnel.amplitudes(TILTED, filmed)
        np.testing.assert_allclose([part[n] for part in got], expected, atol=1e-12)


@pytest.mark.parametrize("between", [False, True])
def test_a_gap_of_the_medium_above_is_the_limit_of_its_index(between):
    """Where an index is that of the next layer, all is 0 at the horizon but the sum."""
    cosines = np.linspace(0.0, 1.0, 33)
    layers = [INDICES[0], 1.5 * np.ones(3)] if between else [INDICES[0]]

    def stack(gap):
        indices = np.stack([*layers, gap * np.ones(3)])
        return amplitudes(cosines, LAM, indices, THICK[: len(indices) - 1])

    for exact, near in zip(stack(1.0), stack(1.0 + 1e-9), strict=True):
        assert np.isfinite(exact).all()
        # the root of 2e-9 at the horizon
        np.testing.assert_allclose(exact[:, 1:], near[:, 1:], atol=1e-4)
