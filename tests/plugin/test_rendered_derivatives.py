"""Derivatives of a rendering where a look-up is a loop, and of values under layers.

The other surfaces are thorough.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.kinds import COATED, FILMED
from tests.support.lanes import interaction, vectors
from tests.support.layered import load, pairs
from tests.support.orders import thin_grating
from tests.support.rendered import check, plate

#: Parameters of surfaces, and values at which derivatives are taken.
LAYERED = {
    "coat": (
        COATED[0] | {"lateral_scale": 0.9},
        {"coat_eta": 1.5, "lateral_scale": 0.9, "height_scale": 0.8, "eta.value": 0.9},
    ),
    "film": (
        FILMED[0], {"film_k": 0.05, "film_eta": 1.7, "film_thickness": 240.0, "k.value": 6.0},
    ),
}  # fmt: skip


def test_a_loop_over_taps_has_all_derivatives(mono):
    at = {"orientation": 20.0, "lateral_scale": 1.5, "height_scale": 0.9}
    check(plate("metal", 6.0), at, spp=16)


@pytest.mark.parametrize("layer", LAYERED)
def test_values_have_the_derivatives_of_differences(mono, layer):
    given, at = LAYERED[layer]
    bsdf, (wi, wo, _) = load(**given), (part[:60] for part in pairs())
    si, out, parameters = interaction(wi, 550.0), vectors(wo), mi.traverse(bsdf)

    def values(changed, differentiable=False):
        for name, value in changed.items():
            parameters[name] = value
            if differentiable:
                dr.enable_grad(parameters[name])
        parameters.update()
        return bsdf.eval(mi.BSDFContext(), si, out)

    for name, value in at.items():
        found = values(at, differentiable=True)
        for other in at:  # arrays: one kernel serves all parameters
            dr.set_grad(parameters[other], dr.opaque(mi.Float, float(other == name)))
        dr.enqueue(dr.ADMode.Forward, *(parameters[other] for other in at))
        dr.traverse(dr.ADMode.Forward)
        slope, step = np.array(dr.grad(found)), 1e-3 * value
        high, low = (np.array(values(at | {name: value + sign * step})) for sign in (1, -1))
        expected = (high - low) / (2.0 * step)
        # single precision of the difference
        assert np.abs(slope - expected).sum() < 2e-3 * np.abs(expected).sum(), name


def derivatives(bsdf, names: tuple[str, ...], share: float) -> list[float]:
    """Reverse derivatives of light that has a share of a loss, over the share."""
    loaded = mi.load_dict(bsdf)
    parameters = mi.traverse(loaded)
    wo = [polar(theta, 20.0) for theta in np.linspace(0.0, 80.0, 64)]
    for name in names:
        dr.enable_grad(parameters[name])
        parameters.set_dirty(name)
    parameters.update()
    si = interaction(polar(10.0, 190.0), 550.0)
    light = dr.sum(loaded.eval(mi.BSDFContext(), si, vectors(wo))[0])
    dr.backward(light * dr.opaque(mi.Float, share))
    return [dr.grad(parameters[name])[0] / share for name in names]


@pytest.mark.parametrize("surface", ["metal", "places"])
def test_derivatives_hold_in_pictures_of_any_size(mono, surface):
    """A pixel's share of the mean over a picture, times a packed half float, is subnormal."""
    bsdf, names = plate(surface, 6.0), ("orientation", "lateral_scale")
    assert derivatives(bsdf, names, 1e-6) == pytest.approx(derivatives(bsdf, names, 1.0), rel=1e-3)


def test_derivatives_of_solved_orders_hold_in_pictures_of_any_size():
    mi.set_variant("llvm_ad_rgb")
    bsdf, names = md.bsdf_dict(thin_grating(), coherence_width=6.0), ("orientation",)
    assert derivatives(bsdf, names, 1e-8) == pytest.approx(derivatives(bsdf, names, 1.0), rel=1e-3)
