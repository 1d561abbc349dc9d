"""Gratings under a film: the solver's limits, and the model beside what is kept."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import j0

from docs.make.validation import filmed, rayleigh
from docs.make.validation.cases import ALUMINIUM, Grating, order_sines
from docs.make.validation.filmed import GRATINGS, STACKS, Stack
from docs.make.validation.model import in_plane
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.optics.mean_second_order import mean_of_waves


def test_a_film_of_air_is_the_bare_grating_of_the_reduced_expansion():
    grating, wavelength = GRATINGS[2], 610.0
    found = filmed.solve(grating, Stack("", ALUMINIUM, 1.0, 200.0), 30.0, wavelength, 16)
    orders = rayleigh.solve(
        grating.heights(256), ALUMINIUM[wavelength], wavelength, in_plane(0.5), 31
    )
    powers = np.abs(np.diagonal(orders.jones, axis1=1, axis2=2)) ** 2
    powers *= orders.wo[:, 2:] / np.cos(np.radians(30.0))
    place = np.searchsorted(order_sines(2.5, wavelength, 30.0)[0], orders.order[:, 0])
    assert found[:, place].T == pytest.approx(powers, abs=1e-9)


def test_what_is_kept_is_what_is_solved_and_has_converged():
    stack, grating = STACKS[3], GRATINGS[3]
    kept = filmed.shipped_film(stack)
    assert kept.change.max() < 1e-6
    part = kept.where(period=1.1, depth=grating.depth, theta=60.0, wavelength=460.0)
    solved = filmed.solve(grating, stack, 60.0, 460.0, 14)
    assert np.stack([part.rows["te"], part.rows["tm"]]) == pytest.approx(solved, abs=1e-7)


@pytest.mark.parametrize("stack", STACKS, ids=lambda stack: stack.name)
def test_gratings_of_slope_up_to_a_tenth(stack):
    found = filmed.deviations(stack, "small_slope")
    assert found.max() < 0.1
    assert found[0].max() < 0.007  # of slope 0.03: first order is exact as heights go to 0
    assert np.median(found / filmed.deviations(stack, "kirchhoff")) < 0.3


def test_of_thick_films_the_mean_of_the_second_order_is_most_of_it():
    first, default = (
        filmed.deviations(STACKS[4], model)[2, 2] for model in (filmed.FIRST, "small_slope")
    )
    assert first > 0.15
    assert default < 0.5 * first


@pytest.mark.parametrize("stack", STACKS, ids=lambda stack: stack.name)
def test_the_mean_is_that_of_small_gratings(stack):
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
    found = mean_of_waves(
        np.array([cosine]),
        film,
        np.array([q / k]),
        np.array([power]),
        azimuths=np.array([0.0, np.pi]),  # across the grooves alone
        mode_width=0.0,
    )
    # of (kh)² h² beside h², which is 4e-5
    assert found == pytest.approx(expected, rel=2e-3)
