"""Derivatives with respect to what a scene may change, and that changing it needs no new kernel."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction as md
from tests.support.directions import Array, uniform_directions
from tests.support.lanes import interaction, spectra, vectors

# a steep grating bends light further than the model likes; that is not the point here
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]

GRATING = md.gratings.sinusoidal(1.6, 0.25, periods=3, pixels_per_period=20)
WAVELENGTHS = [[420.0, 500.0, 580.0, 680.0]]
PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}}


def load(**parameters: Any) -> dict[str, Any]:
    return md.bsdf_dict(GRATING, coherence_width=5.0, tolerance=1e-4, **parameters)


def lit_directions() -> tuple[Array, Array]:
    """Pairs up to the horizon, where the energy's bound matters, half of them within an order."""
    rng = np.random.default_rng(5)
    wi, wo = uniform_directions(400, rng, 0.05), uniform_directions(400, rng, 0.05)
    orders = rng.integers(-2, 3, 400) * 0.55 / 1.6
    wo[:200, :2] = -wi[:200, :2] + rng.normal(0, 0.05, (200, 2))
    wo[:200, 0] += orders[:200]
    z2 = 1.0 - np.sum(wo[:, :2] ** 2, axis=1)
    good = z2 > 0.01
    wo[:, 2] = np.sqrt(np.maximum(z2, 0.0))
    return wi[good], wo[good]


def compared(
    own: dict[str, Any], name: str, at: float, step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Derivatives of `eval` with respect to a parameter, and central differences of 2 `step`."""
    wi, wo = lit_directions()
    si, outgoing, context = interaction(wi, WAVELENGTHS), vectors(wo), mi.BSDFContext()
    bsdf = mi.load_dict(load(**own))
    parameters = mi.traverse(bsdf)

    def values(value: float, differentiable: bool = False) -> Any:
        parameters[name] = type(parameters[name])(value)
        if differentiable:
            dr.enable_grad(parameters[name])
        parameters.update()
        return bsdf.eval(context, si, outgoing)

    value = values(at, differentiable=True)
    dr.forward(parameters[name])
    derivative = spectra(dr.grad(value))
    differences = (spectra(values(at + step)) - spectra(values(at - step))) / (2.0 * step)
    return derivative, differences


def test_under_a_film_the_default_height_scale_has_one_derivative():
    mi.set_variant("llvm_ad_spectral")
    # without s, whose slope changes at its nodes, of which 1 is one
    own = {"material": "Al", "film_ior": 1.5, "film_thickness": 300.0, "energy_conserving": False}
    derivative, differences = compared(own, "height_scale", 1.0, 2e-3)
    # 7 % where g is interpolated between the nodes of s
    assert np.abs(derivative - differences).sum() < 5e-3 * np.abs(differences).sum()


def scene(bsdf: dict[str, Any]) -> Any:
    """A plate under a distant lamp, seen from a way off."""
    view = mi.ScalarTransform4f().look_at([0.8, 0.2, 3.0], [0, 0, 0], [0, 1, 0])
    film = {
        "type": "hdrfilm", "width": 6, "height": 6, "rfilter": {"type": "box"},
        "pixel_format": "rgb",
    }  # fmt: skip
    return mi.load_dict(
        {
            "type": "scene",
            # the lamp alone is sampled: a fraction of the code to compile, by the same parameters
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "sensor": {"type": "perspective", "fov": 30, "to_world": view, "film": film},
            "light": {"type": "directional", "direction": [0.35, 0.2, -1.0], "irradiance": 1.0},
            "plate": {"type": "rectangle", "bsdf": bsdf},
        }
    )


RENDERED = ("height_scale", "orientation", "eta", "nested.reflectance.value")


def test_changing_a_parameter_compiles_no_kernel(variant):
    loaded = scene(load(int_ior=1.5, pigment=PIGMENT))
    parameters = mi.traverse(loaded)
    values = {key: float(np.array(parameters[f"plate.bsdf.{key}"]).ravel()[0]) for key in RENDERED}

    def compiled(factor: float, *changed: str) -> int:
        """Kernels that a step of gradient descent compiles."""
        for key in RENDERED:
            name = f"plate.bsdf.{key}"
            value = (values[key] or 10.0) * (factor if key in changed else 1.0)
            parameters[name] = type(parameters[name])(value)
            dr.enable_grad(parameters[name])
        parameters.update()
        dr.backward(dr.mean(mi.render(loaded, parameters, spp=4), axis=None))
        dr.eval([dr.grad(parameters[f"plate.bsdf.{key}"]) for key in RENDERED])
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
        return sum(not k["cache_hit"] for k in kernels)

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        # Mitsuba's own spectra start as literals: their second value may need another kernel
        for factor in (1.0, 0.97):
            compiled(factor, *RENDERED)
        found = {key: [compiled(factor, key) for factor in (0.94, 0.83)] for key in RENDERED}
    assert set(map(tuple, found.values())) == {(0, 0)}, found
