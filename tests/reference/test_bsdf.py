"""The reference: against sums over pixels and closed forms of gratings, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.optics.geometry import kirchhoff_factor, wavenumber
from mitsuba_diffraction.reference import Sigmas, screen_power
from tests.support.directions import polar, riemann_power, rough_patch

#: Odd and even numbers of pixels, not square, nor are the pixels; 1.95 × 1.8 µm.
SMALL = rough_patch((12, 15), (0.13, 0.15), 0.3)
#: Well below 1/2 of the patch, so that several lobes overlap; σ in µm.
SIGMA = 0.45


@pytest.mark.parametrize("coherence", reference.COHERENCES)
@pytest.mark.parametrize("kappa", [0.0, 7.0, 31.0])
def test_the_power_is_that_of_a_sum_over_pixels_of_the_plane(coherence, kappa):
    screen = np.exp(1j * kappa * SMALL.heights)
    # The sum repeats with 2π/dx = 48 rad/µm: up to 5 from 0 no other period's lobe is in reach
    for alpha, beta in [(0.0, 0.0), (3.1, -2.2), (-4.0, 1.3), (2.2, 4.9)]:
        exact = riemann_power(SMALL, alpha, beta, kappa, SIGMA, coherence)
        computed = screen_power(
            screen, SMALL.pixel_size, alpha, beta, Sigmas(SIGMA, SIGMA), coherence
        )
        # rounding of sums of 1e4 terms, relative to the largest that any direction gets
        assert abs(computed - exact) < 1e-12 * 4 * np.pi**2 * SIGMA**4


@pytest.mark.parametrize(
    ("coherence", "place"),
    [("ensemble", None), ("patch", None), ("surface", (0.31, -5.02)), ("surface", (1.9, 0.0))],
)
def test_the_brdf_is_the_factor_times_that_power(coherence, place):
    wi, wo = polar(50, 30), polar(35, 50)
    k = float(wavenumber(600.0))
    u, v, w = wi + wo
    power = riemann_power(SMALL, k * u, k * v, k * w, SIGMA, coherence, place)
    # without order 0, which is a mirror's
    flat = riemann_power(SMALL, k * u, k * v, 0.0, SIGMA, coherence, place)
    assert flat < 1e-10 * power
    expected = float(kirchhoff_factor(wi, wo, 600.0, SIGMA)) * power
    value = reference.brdf(
        SMALL, wi, wo, 600.0, coherence_width=4 * SIGMA, coherence=coherence, place=place
    )
    assert value.shape == (1,)
    # rounding, of a small part of all power; under one window order 0 interferes
    bound = 1e-9 if coherence == "ensemble" else 4.0 * np.sqrt(1e-10)
    assert value[0] == pytest.approx(expected, rel=bound)


def test_an_ensemble_is_the_mean_over_all_places():
    # |P|² has no frequencies beyond those of 12 × 15 pixels, twice over: this grid's mean is exact
    n = 32
    step = np.array(SMALL.extent) / n
    places = np.indices((n, n)).reshape(2, -1).T * step + 0.017
    wi, wo, given = polar(15, 200), polar(30, 30), {
        "coherence_width": 4 * SIGMA, "eta": 1.5,
    }  # fmt: skip
    values = reference.brdf(
        SMALL, wi, wo, np.full(n * n, 550.0), coherence="surface", place=places, **given
    )
    assert values.std() > 0.3 * values.mean()  # there is speckle
    # rounding
    assert values.mean() == pytest.approx(reference.brdf(SMALL, wi, wo, 550.0, **given)[0], 1e-9)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_facet_that_descends_towards_an_axis_reflects_towards_it(axis):
    # one wavelength of path at normal incidence: all light leaves in order +1
    lam, period = 0.5, 2.0
    angle = np.degrees(np.arcsin(lam / period))
    depth = lam / (1 + np.cos(np.radians(angle)))
    field = gratings.blazed(period, depth, axis="xy"[axis], periods=8)
    towards, away = polar(angle, 90.0 * axis), polar(angle, 90.0 * axis + 180.0)
    for coherence in reference.COHERENCES:
        lit, dark = reference.brdf(
            field, polar(0), [towards, away], 500.0, coherence_width=16.0, coherence=coherence
        )
        # sinc² of 0 against sinc² of 2: nothing but what sampling with 64 pixels leaves
        assert lit > 1e4 * dark


def test_an_open_patch_sends_nothing_beyond_its_pixels_frequencies():
    field = HeightField(np.random.default_rng(0).normal(0, 0.02, (8, 8)), 0.2, cut_out=True)
    wi, wo = [-0.390, -0.855, 0.342], [-0.120, -0.982, 0.146]
    values = reference.brdf(field, wi, wo, [385.0, 550.0])
    assert values[0] == 0.0 < values[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"coherence": "none"}, "coherence='none' must be one of ensemble, patch"),
        ({"coherence": "surface"}, "coherence='surface' needs a place"),
        ({"coherence": "patch", "place": (0.0, 0.0)}, "coherence='patch' takes no place"),
        ({"coherence": "surface", "place": (1.0, 2.0, 3.0)}, r"place has shape \(3,\)"),
        ({"coherence": "surface", "place": (1.0, np.nan)}, "place must be finite"),
        ({"coherence_width": 0.0}, "coherence_width=0 must be a positive number of µm"),
        ({"coherence_width": -1.0}, "coherence_width=-1 must be a positive"),
        ({"coherence_width": np.nan}, "coherence_width=nan must be a positive"),
        ({"coherence_width": np.inf}, "coherence_width=inf must be a positive"),
        ({"wavelength": 0.0}, "wavelength must be positive, in nm"),
        ({"wavelength": np.nan}, "wavelength must be positive, in nm"),
        ({"wi": [0.0, 1.0]}, r"wi has shape \(2,\)"),
        ({"wo": [0.0, 0.6, 0.6]}, "wo must be unit vectors, one has the length 0.8485"),
        ({"wi": [0.0, np.nan, 1.0]}, "wi must be unit vectors"),
        ({"wi": np.zeros((2, 3)), "wo": np.zeros((3, 3))}, "do not broadcast to one length"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(arguments, message):
    given = {"wi": polar(0), "wo": polar(0), "wavelength": 500.0} | arguments
    with pytest.raises(DiffractionError, match=message) as caught:
        reference.brdf(SMALL, **given)
    assert "\n" not in str(caught.value)
