"""Polarised variants: Mueller matrices of the model, between Mitsuba's bases."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import as_single, polar
from tests.support.lanes import interaction, vectors
from tests.support.layered import load, pairs
from tests.support.stokes import matrices
from tests.support.variants import use

pytestmark = pytest.mark.thorough

LAM = np.array([450.0, 520.0, 610.0, 680.0])
CONDUCTOR = {"eta": 0.9, "k": 6.0}
THROUGH = {"plugin": "diffraction_dielectric", "int_ior": 1.5, "ext_ior": 1.0}


@pytest.fixture
def polarised() -> None:
    """The fastest polarised variant that runs."""
    use("llvm_ad_spectral_polarized", "scalar_spectral_polarized")


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        ({"int_ior": 1.5, "ext_ior": 1.0}, {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}),
        ({"material": "Al"}, {"type": "conductor", "material": "Al"}),
        ({"material": "Au"}, {"type": "conductor", "material": "Au"}),
    ],
)
@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
def test_a_flat_patch_s_specular_light_is_mitsuba_s(polarised, ours, theirs, mode):
    flat = md.HeightField(np.zeros((40, 40)), 0.08)
    smooth, wide = mi.load_dict(theirs), {"coherence_width": 65.0}  # a lobe far from the horizon
    bsdf, mirror = load(flat, **ours, **wide), load(flat, material="none", **wide)
    for theta, phi in ((0.0, 0.0), (30.0, 10.0), (56.0, 100.0), (75.0, 200.0)):
        wi = as_single(polar(theta, phi))[None]
        wo = wi * [-1, -1, 1]
        found, flat_one = (matrices(b, wi, wo, LAM, mode) for b in (bsdf, mirror))
        found = found / flat_one[..., :1, :1]
        context = mi.BSDFContext(getattr(mi.TransportMode, mode))
        context.component = 0
        si = interaction(wi, LAM[None])
        weight = np.array(smooth.sample(context, si, 0.5, mi.Point2f(0.5))[1], float)
        weight = np.moveaxis(weight.reshape(4, 4, 4), 2, 0)
        assert found[0] == pytest.approx(weight, abs=1e-4)


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("theta", [30.0, 56.0, 75.0, 150.0, 120.0])
def test_through_a_flat_dielectric_specular_light_is_mitsuba_s(polarised, mode, theta):
    flat, n = md.HeightField(np.zeros((40, 40)), 0.08), {"int_ior": 1.5, "ext_ior": 1.0}
    smooth, bsdf = (
        mi.load_dict({"type": "dielectric", **n}),
        load(
            flat, plugin="diffraction_dielectric", coherence_width=65.0, **n
        ),  # far from the horizon
    )
    wi = as_single(polar(theta, 70.0))[None]
    si = interaction(wi, LAM[None])
    for component in (0, 1):
        context = mi.BSDFContext(getattr(mi.TransportMode, mode))
        context.component = component
        sample, weight = smooth.sample(context, si, 0.5, mi.Point2f(0.5))
        wo = as_single(np.array(sample.wo, float).reshape(1, 3))
        expected = np.moveaxis(np.array(weight, float).reshape(4, 4, 4), 2, 0)
        if not expected.any():  # reflected totally
            continue
        found = matrices(bsdf, wi, wo, LAM, mode)[0]
        assert found / found[:, :1, :1] == pytest.approx(expected / expected[:, :1, :1], abs=2e-4)


@pytest.mark.parametrize("given", [CONDUCTOR, THROUGH, THROUGH | {"thin": True}])
def test_the_first_entry_of_light_on_all_sides_is_that_of_unpolarised_variants(polarised, given):
    wi, wo, _ = pairs(60)
    turned = [1, 1, -1]
    cases = [(wi, wo * turned), (wi * turned, wo), (wi * turned, wo * turned), (wi, wo)]
    cases = [(as_single(a), as_single(b)) for a, b in cases]
    found = [matrices(load(**given), *case, LAM)[..., 0, 0] for case in cases]
    mi.set_variant(mi.variant().removesuffix("_polarized"))
    bsdf, lam = load(**given), np.tile(LAM, (len(wi), 1))
    for one, (there, back) in zip(found, cases, strict=True):
        si = interaction(there, lam)
        expected = np.array(bsdf.eval(mi.BSDFContext(), si, vectors(back)), float).T
        assert one == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())
