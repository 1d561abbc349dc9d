"""Polarised variants of `diffraction_orders`: Mueller matrices between Mitsuba's bases."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.reference.boundary import mueller
from mitsuba_diffraction.reference.fresnel import amplitudes
from tests.support.directions import Array, as_single, polar
from tests.support.lanes import interaction
from tests.support.orders import load, shallow_grating
from tests.support.stokes import bases, matrices, rotation
from tests.support.variants import use

INDEX = 0.9 + 6.0j
LAM = np.array([510.0, 540.0, 570.0, 595.0])
WI = as_single([polar(theta, phi) for theta, phi in ((0, 0), (30, 10), (56, 100), (70, 300))])
MODES = ["Radiance", "Importance"]


#: The first has no kernels to compile.
VARIANTS = [
    "scalar_spectral_polarized",
    pytest.param("llvm_ad_spectral_polarized", marks=pytest.mark.thorough),
]
kernels_alone = pytest.mark.parametrize("polarised", VARIANTS[1:], indirect=True)


@pytest.fixture(params=VARIANTS)
def polarised(request: pytest.FixtureRequest) -> None:
    """A polarised variant, if it runs."""
    use(request.param)


def normalised(values: Array) -> Array:
    return values / values[..., :1, :1]


@kernels_alone
@pytest.mark.parametrize("mode", MODES)
def test_a_flat_metal_polarises_as_mitsuba_s_conductor(polarised, mode):
    spectra = {name: {"type": "uniform", "value": v} for name, v in (("eta", 0.9), ("k", 6.0))}
    smooth = mi.load_dict({"type": "conductor", **spectra})
    mirror = load(shallow_grating(INDEX), orientation=20.0)
    found = normalised(matrices(mirror, WI, WI * [-1, -1, 1], LAM, mode))
    si = interaction(WI, np.tile(LAM, (len(WI), 1)))
    context = mi.BSDFContext(getattr(mi.TransportMode, mode))
    weight = np.array(smooth.sample(context, si, 0.5, mi.Point2f(0.5))[1], float)
    # linear interpolation in 32 cells along τ: 1.9e-3, 2e-4 in 64
    assert found == pytest.approx(normalised(np.moveaxis(weight, (3, 2), (0, 1))), abs=3e-3)


def test_a_table_of_efficiencies_depolarises(polarised):
    values = matrices(load(OrderTable.mirror(0.6)), WI, WI * [-1, -1, 1], LAM)
    assert np.all(values[..., 0, 0] > 0.0)
    values[..., 0, 0] = 0.0
    assert np.all(values == 0.0)


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("mode", MODES)
def test_orders_of_shallow_grooves_polarise_as_the_model_of_diffraction(polarised, mode, order):
    heights = 5e-4 * np.cos(2.0 * np.pi * np.arange(16) / 16)
    field = md.HeightField(np.tile(heights, (16, 1)), 0.6 / 16)
    model = load(
        field, eta=0.9, k=6.0, orientation=20.0, energy_conserving=False,
        coherence_width=60.0,
    )  # fmt: skip
    grating = load(shallow_grating(INDEX, 0.1), orientation=20.0, coherence_width=60.0)
    wavelengths = np.full(4, 550.0)
    turn, apart = np.radians(20.0), order * 0.55 / 0.6
    wo = -WI + [apart * np.cos(turn), apart * np.sin(turn), 0.0]
    seen = np.hypot(wo[:, 0], wo[:, 1]) < 0.95
    wi, wo = WI[seen], wo[seen]
    wo[:, 2] = np.sqrt(1.0 - wo[:, 0] ** 2 - wo[:, 1] ** 2)
    found, expected = (
        normalised(matrices(bsdf, wi, as_single(wo), wavelengths, mode))
        for bsdf in (grating, model)
    )
    assert len(found) > 1
    assert found == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("mode", MODES)
def test_a_metal_under_a_coat_has_the_matrices_of_both_mirrors(polarised, mode):
    bsdf = load(shallow_grating(INDEX / 1.5, superstrate=1.5), orientation=20.0)
    values = normalised(matrices(bsdf, WI, WI * [-1, -1, 1], LAM, mode))
    for wi, found in zip(WI, values[:, 0], strict=True):
        inside = np.sqrt(1.0 - (1.0 - wi[2] ** 2) / 1.5**2)
        face, metal = amplitudes(wi[2], 1.5), amplitudes(inside, INDEX / 1.5)
        through = np.diag(np.sqrt(1.0 - np.abs(face) ** 2))
        upper, once = mueller(np.diag(face)), mueller(through @ np.diag(metal) @ through)
        # sums of powers; what bounces is depolarised
        r, g = upper[0, 0], mueller(np.diag(metal))[0, 0]
        bounced = (1.0 - r) ** 2 * (g / (1.0 - r * g) - g)
        expected = upper + once + np.diag([bounced, 0.0, 0.0, 0.0])
        light = (-wi, wi * [-1, -1, 1]) if mode == "Importance" else (wi * [1, 1, -1], wi)
        first, last = (direction[None] for direction in light)
        s = np.array([[-first[0, 1], first[0, 0], 0.0]]) / max(np.hypot(*first[0, :2]), 1e-9)
        s = s if s.any() else np.array([[0.0, 1.0, 0.0]])
        turned = rotation(s, bases(last), last)[0] @ expected @ rotation(bases(first), s, first)[0]
        # in 16 cells, at 70° near the face's critical angle: 1.2e-2, 2.5e-4 in 64
        assert found == pytest.approx(turned / turned[0, 0], abs=0.015)
