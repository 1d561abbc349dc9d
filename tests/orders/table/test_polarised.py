"""Mueller matrices of tables of orders: between nodes, in files, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.reference.boundary import mueller
from mitsuba_diffraction.reference.model import small_slope
from tests.orders.kinds import light
from tests.support.orders import groove_matrices, shallow_grating
from tests.support.stokes import REVERSAL

INDEX = 0.9 + 6.0j
GRATING = shallow_grating(INDEX, 0.1)
LORENTZ = np.diag([1.0, -1.0, -1.0, -1.0])


#: Directions over the hemisphere but its rim, and wavelengths.
LIGHT = light(100, 0.985, GRATING.wavelengths, seed=2)


def test_matrices_between_nodes_are_those_of_the_model():
    x, y, lam = LIGHT
    for m in (0, 1):
        tangential = x + m * lam / (1e3 * GRATING.period)
        seen = np.abs(tangential) < 0.98 * np.sqrt(1.0 - y**2)
        a, b = x[seen], y[seen]
        wi = np.stack([-a, -b, np.sqrt(1.0 - a**2 - b**2)], axis=-1)
        wo = np.stack([tangential[seen], b, np.sqrt(1.0 - tangential[seen] ** 2 - b**2)], axis=-1)
        expected = mueller(groove_matrices(wi, wo, small_slope(wi, wo, INDEX)))
        if m:
            expected *= 0.1**2 * (wi[:, 2] * wo[:, 2])[:, None, None]
        # of 12 nodes along ρ 2.4e-3, a tenth of it with 24; even cells between them 3.5e-3
        assert GRATING.mueller(a, b, lam[seen], m) == pytest.approx(expected, abs=3.5e-3)


@pytest.mark.parametrize("m", [0, 1])
def test_matrices_are_those_of_jones_matrices_with_the_table_s_efficiency(m):
    x, y, lam = LIGHT
    matrices, power = (look_up(x, y, lam, m) for look_up in (GRATING.mueller, GRATING.efficiency))
    assert matrices[:, 0, 0] == pytest.approx(power, abs=1e-12)
    # M^T G M = √det(M) G of pure matrices (Barakat 1981): no input gains polarisation
    product = matrices.swapaxes(1, 2) @ LORENTZ @ matrices
    scale = product[:, :1, :1]
    assert product == pytest.approx(scale * LORENTZ, abs=1e-12)
    assert np.all(scale[power > 0.0] > 0.0)


@pytest.mark.parametrize("m", [0, 1])
def test_reversed_light_has_the_transposed_matrix(m):
    x, y, lam = LIGHT
    there = GRATING.mueller(x, y, lam, m)
    back = GRATING.mueller(-x - m * lam / (1e3 * GRATING.period), -y, lam, m)
    expected = REVERSAL @ there.swapaxes(1, 2) @ REVERSAL
    assert back == pytest.approx(expected, abs=1e-5)  # single precision
