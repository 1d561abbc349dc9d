"""The mean of the second order under a film: limits, and another expansion of the bare surface."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.blend import ScaleRoughness
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.optics.mean_second_order import (
    LIMIT,
    coherent,
    exponents,
    limited,
    mean_gain,
    mean_of_waves,
)
from mitsuba_diffraction.optics.second_order import Perturbation

COSINES = np.cos(np.radians([0.0, 25.0, 50.0, 75.0]))
WAVENUMBER = 2e3 * np.pi / 550.0
LACQUER = Filmed(1.0 + 6.5j, 1.5 + 0.02j, WAVENUMBER * 0.7)
ROUGH = ScaleRoughness(np.array([1.5, 2.5, 4.0]), np.array([2e-4, 3e-4, 1e-4]))


@pytest.mark.parametrize(
    "none", [Filmed(1.56, 1.8, 0.0), Filmed(0.9 + 6j, 1.0, 3.0), Filmed(1.5, 1.5, 3.0)]
)
def test_films_that_are_none_change_nothing(none):
    assert exponents(COSINES, none, ROUGH, WAVENUMBER) == pytest.approx(0.0, abs=1e-12)


def test_a_flat_surface_has_none():
    flat = ScaleRoughness.from_heights(np.zeros((16, 16)), (0.1, 0.1))
    assert np.all(mean_gain(COSINES, LACQUER, flat, WAVENUMBER) == 1.0)


def test_its_logarithm_goes_with_the_square_of_the_heights_up_to_its_limit():
    once, twice = (np.log(mean_gain(COSINES, LACQUER, ROUGH, WAVENUMBER, s)) for s in (0.1, 0.2))
    assert np.abs(once).max() > 1e-4
    assert twice == pytest.approx(4.0 * once, rel=1e-4)  # (x/LIMIT)⁴ of x = 1e-3
    assert np.abs(np.log(limited(np.linspace(-50.0, 50.0, 999)))).max() < LIMIT
    assert limited(-50.0) == pytest.approx(1.0, abs=1e-3)  # and fades beyond it


@pytest.mark.parametrize("index", [1.56, 1.0 + 6.5j])
def test_long_waves_are_kirchhoff_s_phase_alone(index):
    """What tilts no facet to speak of changes no reflectance: m goes with the slopes' square."""
    waves = [ScaleRoughness(np.array([q]), np.ones(1)) for q in (0.04, 0.02)]
    found = [coherent(COSINES, index, one, WAVENUMBER) for one in waves]
    # along the normal that cancels, and what is left goes with their fourth power
    assert found[1] == pytest.approx(0.25 * found[0], rel=0.01, abs=1e-9)


def test_thin_films_count_by_the_square_of_their_fringes():
    found = [
        exponents(COSINES, Filmed(1.0 + 6.5j, 1.5, depth), ROUGH, WAVENUMBER)
        for depth in (1e-3, 5e-4)
    ]
    assert found[1] == pytest.approx(found[0] / 8.0, rel=0.02)  # and they differ from none by d


def test_without_a_film_it_is_that_of_the_bare_surface():
    """In all azimuths, by B₂ of the second order of perturbation."""
    index, cosine, step, power = 1.56, 0.6, 0.4, 1e-3
    azimuth = np.pi * (np.arange(12) + 0.5) / 12
    k = np.array([-0.8, 0.0])
    between = k + step * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    light = Perturbation([0.8, 0.0, cosine], index)
    second = cosine * light.second(np.tile(k, (12, 1)), between).mean(axis=0) * power
    r = np.diagonal(-2j * cosine * light.first(k[None])[0]) / (-2j * cosine)
    added = np.diagonal(second) / r + 2.0 * cosine**2 * power
    weights = np.abs(r) ** 2
    expected = np.sum(weights * added.real) / weights.sum()
    bare = Filmed(index, 1.3, 0.0)
    found = mean_of_waves(
        np.array([cosine]), bare, np.array([step]), np.array([power]), mode_width=0.0
    )
    assert found == pytest.approx(expected, rel=1e-9)
