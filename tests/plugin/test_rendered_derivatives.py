"""Derivatives of a rendering where a look-up is a loop, by layers, and in pictures of any size.

The other surfaces are thorough.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.lanes import interaction, vectors
from tests.support.orders import thin_grating
from tests.support.rendered import SURFACES, check, plate


@pytest.mark.parametrize("name", SURFACES)
def test_the_table_of_surfaces_has_every_differentiable_parameter(mono, name):
    parameters = mi.traverse(mi.load_dict(plate(name, 6.0)))
    fixed = int(mi.ParamFlags.NonDifferentiable)
    names = [key for key, _ in parameters]  # iterating gives pairs
    differentiable = {key for key in names if not int(parameters.flags(key)) & fixed}
    assert differentiable == set(SURFACES[name][1])


@pytest.mark.parametrize(
    ("surface", "at"),
    [
        ("metal", {"orientation": 20.0, "lateral_scale": 1.5, "height_scale": 0.9}),
        ("coat", {"coat_eta": 1.5, "lateral_scale": 0.9}),
        ("film", {"film_thickness": 200.0, "film_eta": 2.0, "film_k": 0.05}),
    ],
)
def test_a_loop_over_taps_has_all_derivatives(mono, surface, at):
    check(plate(surface, 6.0), at, spp=16)


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
