"""Derivatives of coefficients by heights equal differences of tables, forward and backward."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.build.derivatives import HeightDerivatives
from tests.support.directions import Array, rough_patch

#: Even and odd numbers of pixels; so coarse that bins end at the Nyquist frequency of x.
PATCHES = {
    "fine": rough_patch((24, 31), (0.09, 0.08), 0.1, 0.5, seed=2),
    "coarse": rough_patch((15, 12), (0.1, 0.4), 0.1, 0.8, seed=2),
}


def table_of(patch: Any, heights: Array) -> Any:
    # a tolerance at which single coefficients follow the powers, in single precision
    return md.DiffractionTable.build(
        md.HeightField(heights, patch.pixel_size, periodic=True),
        coherence_width=2.0, basis="chebyshev", tolerance=1e-4, wavelength_range=(600.0, 700.0),
    )  # fmt: skip


@pytest.mark.parametrize("name", PATCHES)
def test_coefficients_change_with_heights_as_differences_do(name):
    patch = PATCHES[name]
    change = np.random.default_rng(1).normal(size=patch.shape)
    # the range of heights, which decides the series, stays
    flat = patch.heights.ravel()
    change.ravel()[[flat.argmin(), flat.argmax()]] = 0.0
    table = table_of(patch, patch.heights)
    linear, step = HeightDerivatives(table, patch.heights), 1e-5
    ends = [table_of(patch, patch.heights + sign * step * change) for sign in (1.0, -1.0)]
    assert table.scale == 1.0
    found = linear.forward(change)
    for part, derivative in zip(("coefficients", "order_0"), found, strict=True):
        high, low = (np.asarray(getattr(end, part), float) for end in ends)
        difference = (high - low) / (2.0 * step)
        # coefficients are of single precision: 1e-7 of a power, over twice the step
        assert derivative == pytest.approx(difference, rel=1e-3, abs=2e-2), part
        assert np.abs(derivative).max() > 0.2


@pytest.mark.parametrize("name", PATCHES)
def test_both_ways_are_adjoint(name):
    patch, random = PATCHES[name], np.random.default_rng(1)
    table = table_of(patch, patch.heights)
    linear = HeightDerivatives(table, patch.heights)
    change = random.normal(size=patch.shape)
    forward = linear.forward(change)
    weights = [random.normal(size=part.shape) for part in forward]
    total = sum(float(np.sum(w * part)) for w, part in zip(weights, forward, strict=True))
    assert np.sum(linear.backward(*weights) * change) == pytest.approx(total, rel=1e-10)
