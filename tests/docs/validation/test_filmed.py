"""Gratings under a film: the solver's limits, and the model beside what is kept."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import filmed, rayleigh
from docs.make.validation.cases import ALUMINIUM, order_sines
from docs.make.validation.filmed import GRATINGS, STACKS, Stack
from docs.make.validation.model import in_plane
from docs.make.validation.solutions import stored


def test_a_film_of_air_is_the_bare_grating_of_the_reduced_expansion():
    grating, wavelength = GRATINGS[2], 610.0
    found = filmed.solve(grating, Stack("", "aluminium", 1.0, 200.0), 30.0, wavelength, 16)
    orders = rayleigh.solve(
        grating.heights(256), ALUMINIUM[wavelength], wavelength, in_plane(0.5), 31
    )
    powers = np.abs(np.diagonal(orders.jones, axis1=1, axis2=2)) ** 2
    powers *= orders.wo[:, 2:] / np.cos(np.radians(30.0))
    place = np.searchsorted(order_sines(2.5, wavelength, 30.0)[0], orders.order[:, 0])
    assert found[:, place].T == pytest.approx(powers, abs=1e-9)


def test_what_is_kept_is_what_is_solved_and_has_converged():
    stack, grating = STACKS[3], GRATINGS[3]
    kept = stored(stack.file)
    assert kept.change.max() < 1e-6
    part = kept.where(period=1.1, depth=grating.depth, theta=60.0, wavelength=460.0)
    solved = filmed.solve(grating, stack, 60.0, 460.0, 14)
    assert np.stack([part.rows["te"], part.rows["tm"]]) == pytest.approx(solved, abs=1e-7)


@pytest.mark.parametrize("stack", STACKS, ids=lambda stack: stack.name)
def test_gratings_of_slope_up_to_a_tenth(stack):
    found = filmed.deviations(stack, "small_slope")
    # thick lacquer lacks light that the rough faces diffract twice, which grows as heights squared
    worst, gentle = (0.2, 0.02) if stack.thickness > 300.0 else (0.1, 0.007)
    assert found.max() < worst
    assert found[0].max() < gentle  # of slope 0.03: first order is exact as heights go to 0
    assert np.median(found / filmed.deviations(stack, "kirchhoff")) < 0.3
