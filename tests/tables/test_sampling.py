"""Densities to draw directions from: proper distributions, which lie where the power does."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField
from mitsuba_diffraction.tables.sampling import BANDED, BANDS, density_of, proposals
from tests.support.directions import rough_patch

PATCH = rough_patch((50, 41), (0.08, 0.09), 0.2)


@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
@pytest.mark.parametrize("basis", ["svd", "chebyshev", "taylor"])
def test_they_are_cumulative_distributions(coherence, basis):
    table = DiffractionTable.build(PATCH, coherence_width=3.7, coherence=coherence, basis=basis)
    found = proposals(table)
    assert np.all(found.units > 0.0)
    assert found.rows.shape == (BANDS, found.columns.shape[1] + 1)
    for sums in (found.rows, found.columns):
        assert np.all(sums[..., 0] == 0.0)
        assert np.all(np.diff(sums, axis=-1) >= 0.0)
        assert np.all((sums[..., -1] == 1.0) | (sums[..., -1] == 0.0))


def test_levels_are_the_densities_of_the_sums():
    found = proposals(DiffractionTable.build(PATCH, coherence_width=3.7))
    cells = np.diff(found.rows, axis=1)[..., None] * np.diff(found.columns, axis=2)
    levels = found.levels[..., : cells.shape[2]]
    expected = found.units[:, None, None] * density_of(levels)
    # differences of sums near 1 in single precision
    assert cells == pytest.approx(expected, rel=1e-3, abs=2e-7)


def test_their_cells_hold_the_power_of_the_orders():
    table = DiffractionTable.build(PATCH, coherence_width=3.7)
    found = proposals(table)
    band = 3
    cells = np.diff(found.rows[band])[:, None] * np.diff(found.columns[band], axis=1)
    assert cells.sum() == pytest.approx(1.0, abs=1e-5)  # sums of 1000 single floats
    kappa = BANDED * (band + 0.5) / BANDS * table.expansion.kappa_max
    centres = [
        o + cell * (np.arange(n) + 0.5)
        for o, cell, n in zip(found.origin, found.cell, cells.T.shape, strict=True)
    ]
    x, y = np.meshgrid(*centres)
    inside = np.hypot(x, y) < table.q_limit
    power = np.zeros_like(cells)
    power[inside] = table.window_sum(x[inside], y[inside], kappa)
    beside = np.hypot(x, y) > 4 / table.sigma  # order 0 has no part in the cells
    # cells are the mean over a band of κ, here one κ at the centre of cells a lobe wide
    correlation = np.corrcoef(cells[inside & beside], power[inside & beside])[0, 1]
    assert correlation > 0.9


def test_a_mirror_has_none():
    flat = HeightField(np.zeros((20, 20)), 0.08)
    assert not proposals(DiffractionTable.build(flat, coherence_width=1.6)).units.any()
