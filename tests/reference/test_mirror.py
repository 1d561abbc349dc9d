"""The correction of a mirror's lobe at the horizon: its equation, and the fit of `optics`."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.optics.mirror import horizon_correction
from mitsuba_diffraction.reference.mirror import solution


def test_the_fit_is_that_of_the_fixed_point():
    x, c = solution()
    far, one = np.full_like(x, 99.0), np.float64(1.0)  # C = 1 at the other end
    fitted = horizon_correction(x**2, far, one)
    assert np.abs(fitted / c - 1.0).max() < 0.001


def test_the_solution_is_a_fixed_point():
    x, c = solution()
    kernel = np.exp(-((x[:, None] ** 2 - x**2) ** 2) / 4.0) / np.sqrt(np.pi) * x * (x[1] - x[0])
    # convergence of the iteration
    np.testing.assert_allclose((c * (kernel @ c))[x < 6.0], 1.0, 1e-6)
