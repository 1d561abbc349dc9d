"""Polarised variants: Mueller matrices of the model, between Mitsuba's bases."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from tests.support.directions import Array, as_single, polar, uniform_directions
from tests.support.lanes import interaction, vectors
from tests.support.layered import PATCH, WIDTH, load
from tests.support.stokes import REVERSAL, bases, rotation
from tests.support.variants import runs

pytestmark = pytest.mark.thorough

LAM = np.array([450.0, 520.0, 610.0, 680.0])
CONDUCTOR = {"eta": 0.9, "k": 6.0}
THROUGH = {"plugin": "diffraction_dielectric", "int_ior": 1.5, "ext_ior": 1.0}


@pytest.fixture
def polarised() -> None:
    """The fastest polarised variant that runs."""
    names = ("llvm_ad_spectral_polarized", "scalar_spectral_polarized")
    name = next((name for name in names if name in mi.variants() and runs(name)), None)
    if name is None:
        pytest.skip(f"none of {', '.join(names)} runs on this machine")
    mi.set_variant(name)


def pairs(n: int = 60) -> tuple[Array, Array]:
    rng = np.random.default_rng(5)
    wi, wo = uniform_directions(n, rng, 0.2), uniform_directions(n, rng, 0.2)
    near = slice(0, n // 2)
    wo[near] = wi[near] * [-1, -1, 1]
    wi[0], wo[1] = (0, 0, 1), (0, 0, 1)  # the normal, where a plane of incidence is any
    return as_single(wi), as_single(wo)


def matrices(bsdf: Any, wi: Array, wo: Array, mode: Any = None) -> Array:
    """f·cosθo, (n, 4, 4) a wavelength: (n, wavelengths, 4, 4)."""
    context = mi.BSDFContext(mi.TransportMode.Radiance if mode is None else mode)

    def once(si: Any, out: Any) -> Array:
        return np.array(bsdf.eval(context, si, out), float)  # (4, 4, wavelengths, n)

    if dr.is_jit_v(mi.Float):
        lam = np.tile(LAM, (len(wi), 1))
        return np.moveaxis(once(interaction(wi, lam), vectors(wo)), (3, 2), (0, 1))
    rows = [
        np.moveaxis(once(interaction(i, LAM), vectors(o)), 2, 0)
        for i, o in zip(wi, wo, strict=True)
    ]
    return np.stack(rows)


@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
@pytest.mark.parametrize(
    "material",
    [{"int_ior": 1.56, "ext_ior": 1.0}, CONDUCTOR, CONDUCTOR | {"coat_ior": 1.58}],
)
def test_matrices_are_the_reference_s(polarised, model, material):
    wi, wo = pairs()
    found = matrices(load(model=model, **material), wi, wo)
    index = {"eta": 1.56, "k": 0.0} if "int_ior" in material else CONDUCTOR
    if "coat_ior" in material:
        index = index | {"coat": material["coat_ior"]}
    # light arrives along ωo where radiance is followed
    s_in, s_out = md.reference.boundary.polarisation_axes(wo, wi)
    before, after = rotation(bases(-wo), s_in, -wo), rotation(s_out, bases(wi), wi)
    for n, lam in enumerate(LAM):
        exact = reference.mueller(PATCH, wo, wi, lam, coherence_width=WIDTH, model=model, **index)
        exact = after @ exact @ before * wo[:, 2, None, None]
        # the table's tolerance, and a phase in single precision
        allowed = 1e-3 * exact[:, :1, :1] + 1e-4 * np.abs(exact).max()
        assert np.all(np.abs(found[:, n] - exact) < allowed), (n, lam)
        assert np.abs(found[:, n, 0, 2:]).max() > 1e-3 * np.abs(found).max()


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
    mode = getattr(mi.TransportMode, mode)
    smooth, wide = mi.load_dict(theirs), {"coherence_width": 65.0}  # a lobe far from the horizon
    bsdf, mirror = load(flat, **ours, **wide), load(flat, material="none", **wide)
    for theta, phi in ((0.0, 0.0), (30.0, 10.0), (56.0, 100.0), (75.0, 200.0)):
        wi = as_single(polar(theta, phi))[None]
        wo = wi * [-1, -1, 1]
        found = matrices(bsdf, wi, wo, mode) / matrices(mirror, wi, wo, mode)[..., :1, :1]
        context = mi.BSDFContext(mode)
        context.component = 0
        si = interaction(wi, LAM[None])
        weight = np.array(smooth.sample(context, si, 0.5, mi.Point2f(0.5))[1], float)
        weight = np.moveaxis(weight.reshape(4, 4, 4), 2, 0)
        assert found[0] == pytest.approx(weight, abs=1e-4)


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("theta", [30.0, 56.0, 75.0, 150.0, 120.0])
def test_through_a_flat_dielectric_specular_light_is_mitsuba_s(polarised, mode, theta):
    flat, n = md.HeightField(np.zeros((40, 40)), 0.08), {"int_ior": 1.5, "ext_ior": 1.0}
    mode = getattr(mi.TransportMode, mode)
    smooth, bsdf = (
        mi.load_dict({"type": "dielectric", **n}),
        load(
            flat, plugin="diffraction_dielectric", coherence_width=65.0, **n
        ),  # far from the horizon
    )
    wi = as_single(polar(theta, 70.0))[None]
    si = interaction(wi, LAM[None])
    for component in (0, 1):
        context = mi.BSDFContext(mode)
        context.component = component
        sample, weight = smooth.sample(context, si, 0.5, mi.Point2f(0.5))
        wo = as_single(np.array(sample.wo, float).reshape(1, 3))
        expected = np.moveaxis(np.array(weight, float).reshape(4, 4, 4), 2, 0)
        if not expected.any():  # reflected totally
            continue
        found = matrices(bsdf, wi, wo, mode)[0]
        assert found / found[:, :1, :1] == pytest.approx(expected / expected[:, :1, :1], abs=2e-4)


@pytest.mark.parametrize(
    "given",
    [THROUGH, THROUGH | {"thin": True}],
)
def test_reversed_light_that_goes_through_has_the_transposed_matrix(polarised, given):
    wi, wo = pairs()
    wo, bsdf = as_single(wo * [1, 1, -1]), load(**given)
    there = matrices(bsdf, wi, wo) / np.abs(wo[:, None, 2, None, None])
    back = matrices(bsdf, wo, wi) / wi[:, None, 2, None, None]
    back = back / (2.25 if given == THROUGH else 1.0)  # radiance in the dielectric
    # the matrix of light from ωi to ωo, about the axes that light from ωo to ωi has
    after = rotation(bases(wo), bases(-wo), wo)[:, None]
    before = rotation(bases(-wi), bases(wi), -wi)[:, None]
    expected = REVERSAL @ there.swapaxes(-1, -2) @ REVERSAL
    found = after @ back @ before
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-5 * np.abs(there).max())


@pytest.mark.parametrize("given", [CONDUCTOR, THROUGH, THROUGH | {"thin": True}])
def test_the_first_entry_of_light_on_all_sides_is_that_of_unpolarised_variants(polarised, given):
    wi, wo = pairs()
    turned = [1, 1, -1]
    cases = [(wi, wo * turned), (wi * turned, wo), (wi * turned, wo * turned), (wi, wo)]
    cases = [(as_single(a), as_single(b)) for a, b in cases]
    found = [matrices(load(**given), *case)[..., 0, 0] for case in cases]
    mi.set_variant(mi.variant().removesuffix("_polarized"))
    bsdf, lam = load(**given), np.tile(LAM, (len(wi), 1))
    for one, (there, back) in zip(found, cases, strict=True):
        si = interaction(there, lam)
        expected = np.array(bsdf.eval(mi.BSDFContext(), si, vectors(back)), float).T
        assert one == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())


def test_a_perfect_mirror_depolarises(polarised):
    wi, wo = pairs()
    found = matrices(load(material="none"), wi, wo)
    found[..., 0, 0] = 0.0
    assert np.all(found == 0.0)
