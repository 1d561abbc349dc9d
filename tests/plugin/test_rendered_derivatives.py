"""Derivatives of a rendering where a look-up is a loop; the other surfaces are thorough."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import polar
from tests.support.lanes import interaction, vectors
from tests.support.rendered import check, plate


def test_a_loop_over_taps_has_all_derivatives(mono):
    at = {"orientation": 20.0, "lateral_scale": 1.5, "height_scale": 0.9}
    check(plate("metal", 6.0), at, spp=16)


@pytest.mark.parametrize("surface", ["metal", "places"])
def test_derivatives_hold_in_pictures_of_any_size(mono, surface):
    """A pixel's share of the mean over a picture, times a packed half float, is subnormal."""
    bsdf = mi.load_dict(plate(surface, 6.0))
    parameters, names = mi.traverse(bsdf), ("orientation", "lateral_scale")
    wo = [polar(theta, 20.0) for theta in np.linspace(0.0, 80.0, 64)]
    si = interaction(polar(10.0, 190.0), 550.0)

    def derivatives(share: float) -> list[float]:
        for name in names:
            dr.enable_grad(parameters[name])
            parameters.set_dirty(name)
        parameters.update()
        light = dr.sum(bsdf.eval(mi.BSDFContext(), si, vectors(wo))[0])
        dr.backward(light * dr.opaque(mi.Float, share))
        found = [dr.grad(parameters[name])[0] / share for name in names]
        for name in names:
            parameters[name] = dr.detach(parameters[name])
        return found

    assert derivatives(1e-6) == pytest.approx(derivatives(1.0), rel=1e-3)
