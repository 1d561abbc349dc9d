"""Derivatives of renderings with respect to every parameter of every plugin."""

from __future__ import annotations

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from tests.support.orders import thin_grating
from tests.support.rendered import PIGMENT, SURFACES, TEXELS, check, plate, with_bitmaps
from tests.support.variants import runs

pytestmark = pytest.mark.thorough

WIDTHS = (6.0, 65.0)
VARIANTS = ("llvm_ad_mono", "llvm_ad_rgb", "llvm_ad_spectral")


def of_surface(name: str) -> tuple[str, ...]:
    """Variants of a surface: those of RGB have no windows that follow places."""
    return VARIANTS[::2] if name == "places" else VARIANTS


#: Variants, surfaces and widths, µm. Every surface meets every width, every width every
#: variant.
CASES = [
    (of_surface(name)[(n + m) % len(of_surface(name))], name, width)
    for n, name in enumerate(SURFACES)
    for m, width in enumerate(WIDTHS)
]


@pytest.mark.parametrize("name", SURFACES)
def test_the_list_has_every_differentiable_parameter(name):
    mi.set_variant("llvm_ad_mono")
    parameters = mi.traverse(mi.load_dict(plate(name, 6.0)))
    fixed = int(mi.ParamFlags.NonDifferentiable)
    names = [key for key, _ in parameters]  # iterating gives pairs
    differentiable = {key for key in names if not int(parameters.flags(key)) & fixed}
    assert differentiable == set(SURFACES[name][1])


@pytest.mark.parametrize(("mitsuba_variant", "name", "width"), CASES)
def test_every_parameter_has_the_derivative_of_differences(mitsuba_variant, name, width):
    if not runs(mitsuba_variant):
        pytest.skip(f"Dr.Jit has no device for {mitsuba_variant}")
    mi.set_variant(mitsuba_variant)
    check(plate(name, width), SURFACES[name][1])


@pytest.mark.parametrize("name", ["metal", "coat", "dielectric"])
def test_scales_of_energy_have_the_derivatives_of_differences(name):
    """Of height scales, in which scales of energy are linear; in others they have steps."""
    mi.set_variant("llvm_ad_mono")
    check(plate(name, 6.0, energy_conserving=True), {"height_scale": 0.9, "orientation": 20.0})


@pytest.mark.parametrize(
    ("mitsuba_variant", "thin"),
    [("llvm_ad_mono", False), ("llvm_ad_rgb", True), ("llvm_ad_spectral", False)],
)
def test_solved_orders_have_the_derivatives_of_differences(mitsuba_variant, thin):
    mi.set_variant(mitsuba_variant)
    own = {} if thin else {"beneath": PIGMENT}
    at = {"orientation": 20.0} | ({} if thin else {"nested.reflectance.value": 0.4})
    check(md.bsdf_dict(thin_grating(thin=thin), coherence_width=6.0, **own), at, spp=1024)


def test_a_mix_has_the_derivatives_of_differences():
    mi.set_variant("llvm_ad_spectral")
    mix = {
        "type": "diffraction_mix",
        "back": plate("metal", 6.0),
        "belly": plate("pigment", 12.0),
        "weight_back": 0.4,
    }
    own = {"back.orientation": 20.0, "back.lateral_scale": 1.5, "belly.orientation": 40.0}
    check(mix, {"weight_back": 0.4, "belly.eta": 1.5, **own})


def test_a_mix_of_sheets_has_the_derivatives_of_differences():
    mi.set_variant("llvm_ad_rgb")
    mix = {
        "type": "diffraction_mix",
        "back": plate("sheet", 6.0),
        "belly": plate("sheet", 12.0, lateral_scale=1.0),
        "weight_back": 0.4,
    }
    own = {"back.orientation": 20.0, "belly.orientation": 40.0, "belly.lateral_scale": 0.9}
    check(mix, {"weight_back": 0.4, "back.eta": 1.5, "belly.height_scale": 0.9, **own})


def test_a_mix_by_a_texture_has_the_derivatives_of_differences():
    mi.set_variant("llvm_ad_mono")
    mix = {
        "type": "diffraction_mix",
        "back": plate("textures", 6.0),
        "belly": plate("metal", 12.0),
        "weight_back": with_bitmaps(0.5 * TEXELS),
    }
    check(mix, {"weight_back.data": 0.5 * TEXELS, "back.height_scale.data": TEXELS})
