"""Pairs of directions, materials and boundary models for tests of formulas in every language."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.reference import boundary, coat, model
from tests.support.directions import Array, uniform_directions

#: Index of the coat over the medium above.
COAT = 1.3
#: Indices of materials over the medium above: real, of a metal, weakly absorbing.
INDICES = {"dielectric": 1.5 + 0j, "metal": 0.65 + 5.6j, "absorbing": 1.2 + 0.3j}


class Pairs(NamedTuple):
    """Pairs (n, 3) of directions, κ in rad/µm and variance of the heights in µm² (n,)."""

    wi: Array
    wo: Array
    kappa: Array
    variance: Array


def pairs(count: int) -> Pairs:
    """Return random pairs; the first are the normal, mirrored, equal and opposite directions."""
    rng = np.random.default_rng(8)
    wi, wo = uniform_directions(count, rng, 0.02), uniform_directions(count, rng, 0.02)
    wi[0], wo[1], wo[2], wo[3] = (0, 0, 1), (0, 0, 1), wi[2], wi[3] * [-1, -1, 1]
    wi, wo = wi.astype(np.float32).astype(float), wo.astype(np.float32).astype(float)
    kappa = 25.0 * rng.random(count)
    return Pairs(wi, wo, kappa, 2e-3 * rng.random(count))


def exact_power(
    given: Pairs, index: complex, *, coated: bool = False, name: str = "small_slope"
) -> Array:
    """Return N' of a boundary model by `md.reference` in double precision, (n,)."""
    wi, wo = given.wi, given.wo
    n = COAT if coated else 1.0
    inner = [coat.refracted(w, n) for w in (wi, wo)] if coated else [wi, wo]
    relative = np.full(len(wi), index / n)
    s = model.small_slope_weight(given.kappa, given.variance, relative)
    if name == "kirchhoff":
        s = np.zeros_like(s)
    jones = model.blended(*inner, relative, s)
    if coated:
        jones = coat.transmitted(jones, wi, wo, n, relative)
    return boundary.unpolarised(jones) * (2.0 * inner[0][:, 2] * inner[1][:, 2]) ** 2


def check(found: Array, exact: Array) -> None:
    """Compare in single precision: 1e-5 of the largest, and 1e-3 of each."""
    assert np.abs(found - exact).max() < 1e-5 * exact.max()
    assert np.all(np.abs(found - exact) < 1e-3 * exact)
