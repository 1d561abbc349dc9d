"""The error that a table states: measured again, another way, elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.reference import Sigmas, screen_power
from mitsuba_diffraction.tables.build.error import FLOOR, GLOSSY_RADIUS, worst
from mitsuba_diffraction.tables.build.powers import alternate
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

#: Odd and even, not square, nor are the pixels: 5.04 × 4.55 µm.
PATCH = rough_patch((65, 56), (0.09, 0.07), 0.35)
WIDTH = 4.0


def measured(table, kappas, seed):
    """(near, far) at each κ: Σ|table − reference| and Σ reference, at every reachable bin.

    The bins are moved by up to a half at random, anew for every κ.
    """
    rng = np.random.default_rng(seed)
    (jx, jy), (rx, ry) = table.grid.last, table.grid.radius
    x, y = np.meshgrid(np.arange(-jx, jx + 1), np.arange(-jy, jy + 1))
    reached = (x / rx) ** 2 + (y / ry) ** 2 <= 1.0
    x, y = x[reached], y[reached]
    near = np.hypot(x * table.grid.steps[0], y * table.grid.steps[1]) <= GLOSSY_RADIUS
    errors, sums, sigmas = [], [], Sigmas(table.sigma, table.sigma_0)
    for kappa in kappas:
        qx = (x + rng.uniform(-0.5, 0.5, x.size)) * table.spacing[0]
        qy = (y + rng.uniform(-0.5, 0.5, y.size)) * table.spacing[1]
        inside = np.hypot(qx, qy) <= table.q_limit
        screen = np.exp(1j * kappa * PATCH.heights)
        exact = np.array(
            [
                screen_power(screen, PATCH.pixel_size, a, b, sigmas, table.coherence)
                for a, b in zip(qx[inside], qy[inside], strict=True)
            ]
        ) / (4 * np.pi**2 * table.sigma**4)
        difference = np.abs(table.window_sum(qx, qy, kappa)[inside] - exact)
        parts = near[inside], ~near[inside]
        errors.append([difference[part].sum() for part in parts])
        sums.append([exact[part].sum() for part in parts])
    return np.array(errors), np.array(sums)


@pytest.mark.parametrize(
    ("basis", "coherence"),
    [("svd", "ensemble"), ("svd", "patch"), ("chebyshev", "ensemble"), ("taylor", "patch")],
)
def test_the_stated_error_is_found_again_by_explicit_integrals(basis, coherence):
    table = DiffractionTable.build(
        PATCH,
        coherence=coherence,
        basis=basis,
        coherence_width=WIDTH,
        wavelength_range=(600.0, 800.0),  # few orders, so that the slow way takes a second
    )
    kappas = np.random.default_rng(7).uniform(0.05, 1.0, 4) * table.expansion.kappa_max
    errors, sums = measured(table, kappas, seed=8)
    assert np.all(errors <= table.tolerance * sums)  # anywhere, with no allowance

    stated = table.error["near"], table.error["far"]
    at = [table.error["kappa_near"]] * 3, [table.error["kappa_far"]] * 3
    (near, _), (near_sum, _) = (a.sum(axis=0) for a in measured(table, at[0], seed=9))
    (_, far), (_, far_sum) = (a.sum(axis=0) for a in measured(table, at[1], seed=10))
    # What is stated is one draw of the jitter: of 7 rows and columns near order 0, where the
    # taps' error changes severalfold with it (seeds vary by 40 %), and of 40 elsewhere (15 %)
    assert 0.5 < near / near_sum / stated[0] < 2.0
    assert 0.75 < far / far_sum / stated[1] < 1.35


def test_a_part_that_vanishes_at_one_kappa_is_compared_with_its_largest_value():
    parts = [
        np.array([[1e-4, 0.0], [1.0, 0.0]]),
        np.array([[1e-6, 2e-3], [1e-9, 1.0]]),  # 1e-9 near: less than the floor
    ]
    error = worst([3.0, 4.0], parts)
    assert error["near"] == pytest.approx(1e-6 / FLOOR, rel=1e-12)  # rounding
    assert error["kappa_near"] == 4.0
    assert error["far"] == 2e-3
    assert error["kappa_far"] == 4.0


def test_a_part_that_is_never_there_has_no_error():
    error = worst([3.0], [np.array([[1e-4, 0.0], [1.0, 0.0]])])
    assert error["far"] == 0.0


@pytest.mark.parametrize("last", [(3, 2), (4, 2), (3, 3)])
def test_alternating_signs_put_the_window_on_the_centre(last):
    amplitudes = np.ones((2 * last[1] + 1, 2 * last[0] + 1), complex)
    alternate(amplitudes, last)
    x, y = np.meshgrid(np.arange(-last[0], last[0] + 1), np.arange(-last[1], last[1] + 1))
    # exp(−i q_j·x₀) for x₀ = half the patch is exp(−iπ(jx + jy))
    assert np.array_equal(amplitudes, (-1.0) ** (x + y))


@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
def test_lobes_far_apart_are_still_looked_at(coherence):
    # 4 rows are a tenth of a micrometre or so: half-way between their bins the window is exp(−10⁵)
    few = gratings.blazed(2.5, 0.3, periods=4, rows=4)
    many = gratings.blazed(2.5, 0.3, periods=4)
    error, expected = (
        DiffractionTable.build(
            field, basis="chebyshev", coherence_width=65.0, coherence=coherence
        ).error
        for field in (few, many)
    )
    # the same grating; its other bins are empty, and where their light is none so is the error
    assert error["near"] == pytest.approx(expected["near"], rel=0.05)
    assert error["far"] > 1e-6
