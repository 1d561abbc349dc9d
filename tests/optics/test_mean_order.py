"""The mean of the second order under a film: limits, symmetries, and two other expansions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import j0

from docs.make.validation import filmed
from docs.make.validation.cases import Grating
from mitsuba_diffraction.optics import mean_order
from mitsuba_diffraction.optics.blend import ScaleRoughness
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.optics.mean_order import coherent, exponents, limited, mean_gain
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
    flat = ScaleRoughness.of(np.zeros((16, 16)), (0.1, 0.1))
    assert np.all(mean_gain(COSINES, LACQUER, flat, WAVENUMBER) == 1.0)


def test_its_logarithm_goes_with_the_square_of_the_heights_up_to_its_limit():
    once, twice = (np.log(mean_gain(COSINES, LACQUER, ROUGH, WAVENUMBER, s)) for s in (0.1, 0.2))
    assert np.abs(once).max() > 1e-4
    assert twice == pytest.approx(4.0 * once, rel=1e-4)  # (x/LIMIT)⁴ of x = 1e-3
    assert np.abs(np.log(limited(np.linspace(-50.0, 50.0, 999)))).max() < mean_order.LIMIT
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


@pytest.mark.parametrize("stack", filmed.STACKS, ids=lambda stack: stack.name)
def test_across_the_grooves_it_is_that_of_small_gratings(stack, in_plane):
    """Of the field that order 0 is more than first order's, by Rayleigh's expansion."""
    wavelength, grating, sine = 610.0, Grating("sinusoidal", 2.5, 2e-3), 0.7
    k, q = 2e3 * np.pi / wavelength, 2.0 * np.pi / grating.period
    few = 4
    there, flat = (
        filmed._amplitudes(one, stack, sine, wavelength, few)[0][:, few]
        for one in (grating, Grating("sinusoidal", grating.period, 0.0))
    )
    cosine = np.sqrt(1.0 - sine**2)
    added = there / flat / j0(k * cosine * grating.depth) - 1.0
    expected = np.sum(np.abs(flat) ** 2 * added.real) / np.sum(np.abs(flat) ** 2)
    film = Filmed(stack.index[wavelength], stack.film, k * stack.thickness * 1e-3)
    power = (k * grating.depth) ** 2 / 8.0  # of a sinusoid of this depth
    found = mean_order._of_waves(np.array([cosine]), film, np.array([q / k]), np.array([power]))
    # of (kh)² h² beside h², which is 4e-5
    assert found == pytest.approx(expected, rel=2e-3)


def test_without_a_film_it_is_that_of_the_bare_surface(monkeypatch):
    """In all azimuths, by B₂ of the second order of perturbation."""
    monkeypatch.setattr(mean_order, "_WIDTH", 0.0)
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
    found = mean_order._of_waves(np.array([cosine]), bare, np.array([step]), np.array([power]))
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.fixture
def in_plane(monkeypatch: pytest.MonkeyPatch) -> NDArray[np.float64]:
    """ξ across the grooves alone, and no width of modes."""
    monkeypatch.setattr(mean_order, "_WIDTH", 0.0)
    azimuths = np.array([0.0, np.pi])
    monkeypatch.setattr(mean_order, "_azimuths", lambda: azimuths)
    return azimuths
