"""Interfaces and sheets that let light through, and their samples on either side."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.testing import assert_allclose

import mitsuba_diffraction as md
from tests.support.directions import Array, as_single, polar
from tests.support.lanes import interaction
from tests.support.layered import PATCH, load

INDICES = {"int_ior": 1.5, "ext_ior": 1.0}
SIDES: dict[str, dict[str, Any]] = {"dielectric": {}, "sheet": {"thin": True}}
BELOW = np.array([1, 1, -1])


def both(field: md.HeightField = PATCH, **parameters: Any) -> Any:
    return load(field, plugin="diffraction_dielectric", **INDICES, **parameters)


class OneSide:
    """A BSDF whose directions on one side are as if above, and on the other none."""

    def __init__(self, bsdf: Any, side: float) -> None:
        self._bsdf, self._turn = bsdf, mi.Vector3f(1.0, 1.0, side)

    def sample(self, context: Any, si: Any, one: Any, two: Any) -> Any:
        found, weight = self._bsdf.sample(context, si, one, two)
        found.wo = found.wo * self._turn
        found.pdf = dr.select(found.wo.z > 0.0, found.pdf, 0.0)
        return found, weight

    def pdf(self, context: Any, si: Any, wo: Any) -> Any:
        return dr.select(wo.z > 0.0, self._bsdf.pdf(context, si, wo * self._turn), 0.0)


def sampled(
    bsdf: Any, theta: float, count: int = 1 << 15, azimuth: float = 20.0
) -> tuple[Array, Array]:
    """Weights of samples at 550 nm, and which are reflected."""
    si = interaction(np.tile(as_single(polar(theta, azimuth)), (count, 1)), 550.0)
    rng = mi.PCG32(count)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    context = mi.BSDFContext(mi.TransportMode.Importance)
    found, weight = bsdf.sample(context, si, one, two)
    value, pdf = bsdf.eval_pdf(context, si, found.wo)
    dr.eval(found, weight, value, pdf)  # one kernel instead of five
    valid = np.array(found.pdf) > 0
    # not pytest.approx, which takes half a second for so many numbers
    assert_allclose(np.array(found.pdf)[valid], np.array(pdf)[valid], rtol=1e-4)
    weights = np.array(weight, float)[0]
    expected = np.array(value, float)[0][valid]
    assert_allclose((weights * np.array(pdf))[valid], expected, rtol=5e-4, atol=5e-7)
    transmits = int(mi.BSDFFlags.GlossyTransmission)
    passed = np.array(found.sampled_type) == transmits
    assert np.all(np.array(found.sampled_component) == passed)
    down = theta < 90.0
    assert np.all((np.array(found.wo.z)[valid & passed] < 0.0) == down)
    eta = 1.0 if "thin = true" in str(bsdf) else 1.5 if down else 1 / 1.5
    assert np.array(found.eta)[passed][0] == pytest.approx(eta)
    return weights, ~passed
