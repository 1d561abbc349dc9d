"""Derivatives of renderings by every parameter of every plugin; changes compile no kernel."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.lanes import bitmap
from tests.support.orders import thin_grating
from tests.support.rendered import GRATING, PIGMENT, SURFACES, TEXELS, check, plate, scene
from tests.support.variants import use

pytestmark = pytest.mark.thorough

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


@pytest.mark.parametrize(("mitsuba_variant", "name", "width"), CASES)
def test_every_parameter_has_the_derivative_of_differences(mitsuba_variant, name, width):
    use(mitsuba_variant)
    check(plate(name, width), SURFACES[name][1])


@pytest.mark.parametrize("name", ["metal", "coat", "dielectric"])
def test_scales_of_energy_have_the_derivatives_of_differences(name):
    """Of height scales, in which scales of energy are linear; in others they have steps."""
    mi.set_variant("llvm_ad_mono")
    check(plate(name, 6.0, energy_conserving=True), {"height_scale": 0.9, "orientation": 20.0})


def test_under_a_film_the_default_height_scale_has_one_derivative(mono):
    """Without s, whose slope changes at its nodes, of which 1 is one."""
    # 7 % where g is interpolated between the nodes of s
    own = {"eta": None, "k": None, "material": "Al", "film_ior": 1.5, "film_thickness": 300.0}
    check(plate("film", 6.0, **own), {"height_scale": 1.0}, within=5e-3)


@pytest.mark.parametrize(
    ("mitsuba_variant", "thin"),
    [("llvm_ad_rgb", True), ("llvm_ad_spectral", False)],
)
def test_solved_orders_have_the_derivatives_of_differences(mitsuba_variant, thin):
    mi.set_variant(mitsuba_variant)
    own = {} if thin else {"beneath": PIGMENT}
    at = {"orientation": 20.0} | ({} if thin else {"nested.reflectance.value": 0.4})
    check(md.bsdf_dict(thin_grating(thin=thin), coherence_width=6.0, **own), at, spp=1024)


def test_a_mix_has_the_derivatives_of_differences(mono):
    mix = {
        "type": "diffraction_mix",
        "back": plate("metal", 6.0),
        "belly": plate("pigment", 12.0),
        "weight_back": 0.4,
    }
    own = {"back.orientation": 20.0, "back.lateral_scale": 1.5, "belly.orientation": 40.0}
    check(mix, {"weight_back": 0.4, "belly.eta": 1.5, **own})


#: What derivatives by heights take, in tables so close that differences of two have no noise.
BY_HEIGHTS = {
    "periodic": "exact", "basis": "chebyshev", "model": "kirchhoff", "tolerance": 1e-4,
}  # fmt: skip


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


def test_a_mix_by_a_texture_has_the_derivatives_of_differences(mono):
    mix = {
        "type": "diffraction_mix",
        "back": plate("textures", 6.0),
        "belly": plate("metal", 12.0),
        "weight_back": bitmap(0.5 * TEXELS, filter_type="bilinear"),
    }
    check(mix, {"weight_back.data": 0.5 * TEXELS, "back.height_scale.data": TEXELS})


def test_changing_a_parameter_compiles_no_kernel(mono):
    loaded = scene(plate("pigment", 6.0))
    parameters, changing = mi.traverse(loaded), SURFACES["pigment"][1]
    values = {key: float(np.array(parameters[f"plate.bsdf.{key}"]).ravel()[0]) for key in changing}

    def compiled(factor: float, *changed: str) -> int:
        """Kernels that a step of gradient descent compiles."""
        for key in changing:
            name = f"plate.bsdf.{key}"
            value = (values[key] or 10.0) * (factor if key in changed else 1.0)
            parameters[name] = type(parameters[name])(value)
            dr.enable_grad(parameters[name])
        parameters.update()
        dr.backward(dr.mean(mi.render(loaded, parameters, spp=4), axis=None))
        dr.eval([dr.grad(parameters[f"plate.bsdf.{key}"]) for key in changing])
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
        return sum(not k["cache_hit"] for k in kernels)

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        # Mitsuba's own spectra start as literals: their second value may need another kernel
        for factor in (1.0, 0.97):
            compiled(factor, *changing)
        found = {key: [compiled(factor, key) for factor in (0.94, 0.83)] for key in changing}
    assert set(map(tuple, found.values())) == {(0, 0)}, found
