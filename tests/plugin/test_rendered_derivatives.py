"""Derivatives of renderings by every parameter of every plugin; changes compile no kernel."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.lanes import bitmap, interaction, vectors
from tests.support.orders import thin_grating
from tests.support.rendered import GRATING, PIGMENT, SURFACES, TEXELS, check, plate
from tests.support.variants import use


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


#: Variants of surfaces in which light has more than one wavelength: their kernels are four times
#: as long, with the same derivatives for each.
COLOURED = {
    "pigment": "llvm_ad_rgb", "patch": "llvm_ad_rgb", "sheet": "llvm_ad_rgb",
    "coat": "llvm_ad_spectral",
}  # fmt: skip


def case_of(n: int, name: str) -> tuple[str, str, float]:
    """Variant, surface and width, µm, by turns; tables of colours are small where windows are."""
    variant = COLOURED.get(name, "llvm_ad_mono")
    return variant, name, 6.0 if variant.endswith("rgb") or n % 2 == 0 else 65.0


CASES = [case_of(n, name) for n, name in enumerate(SURFACES)]


@pytest.mark.thorough
@pytest.mark.parametrize(("mitsuba_variant", "name", "width"), CASES)
def test_every_parameter_has_the_derivative_of_differences(mitsuba_variant, name, width):
    use(mitsuba_variant)
    check(plate(name, width), SURFACES[name][1])


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["metal", "coat", "dielectric"])
def test_scales_of_energy_have_the_derivatives_of_differences(name):
    """Of height scales, in which scales of energy are linear; in others they have steps."""
    mi.set_variant("llvm_ad_mono")
    check(plate(name, 6.0, energy_conserving=True), {"height_scale": 0.9, "orientation": 20.0})


@pytest.mark.thorough
def test_under_a_film_the_default_height_scale_has_one_derivative(mono):
    """Without s, whose slope changes at its nodes, of which 1 is one."""
    # 7 % where g is interpolated between the nodes of s
    own = {"eta": None, "k": None, "material": "Al", "film_ior": 1.5, "film_thickness": 300.0}
    check(plate("film", 6.0, **own), {"height_scale": 1.0}, within=5e-3)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("mitsuba_variant", "thin"),
    [("llvm_ad_rgb", True), ("llvm_ad_spectral", False)],
)
def test_solved_orders_have_the_derivatives_of_differences(mitsuba_variant, thin):
    mi.set_variant(mitsuba_variant)
    own = {} if thin else {"beneath": PIGMENT}
    at = {"orientation": 20.0} | ({} if thin else {"nested.reflectance.value": 0.4})
    check(md.bsdf_dict(thin_grating(thin=thin), coherence_width=6.0, **own), at, spp=1024)


#: What derivatives by heights take, in tables so close that differences of two have no noise.
BY_HEIGHTS = {
    "periodic": "exact", "basis": "chebyshev", "model": "kirchhoff", "tolerance": 1e-4,
}  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("variant", "name", "own"),
    [
        ("llvm_ad_spectral", "metal", {"height_scale": 1.2, "shadowing": "vcavity"}),
        ("llvm_ad_mono_polarized", "metal", {"coat_ior": 1.5}),
        ("llvm_ad_mono", "metal", {"film_ior": 1.5, "film_thickness": 300.0}),
        ("llvm_ad_mono", "dielectric", {}),
        ("llvm_ad_mono", "sheet", {}),
    ],
)
def test_heights_have_the_derivatives_of_differences(variant, name, own):
    """In one direction of all changes of the heights."""
    use(variant)
    change = np.random.default_rng(1).normal(size=GRATING.shape)
    along = {"along": change / np.abs(change).max(), "step": 5e-4}
    # tables of 1e-4, whose errors differ by less from one to the next
    at = {"data": GRATING.heights}
    check(plate(name, 6.0, **(BY_HEIGHTS | own)), at, within=0.01, **along)


@pytest.mark.thorough
def test_a_mix_by_a_texture_has_the_derivatives_of_differences(mono):
    mix = {
        "type": "diffraction_mix",
        "back": plate("textures", 6.0),
        "belly": plate("metal", 12.0),
        "weight_back": bitmap(0.5 * TEXELS, filter_type="bilinear"),
    }
    own = {"back.height_scale.data": TEXELS, "belly.lateral_scale": 1.5, "belly.orientation": 40.0}
    check(mix, {"weight_back.data": 0.5 * TEXELS, **own})
