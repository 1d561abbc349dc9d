"""Options that meet, in a scalar variant: a few directions, without a kernel to compile.

The thorough tests ask more of each: test_kinds.py, test_polarised.py, test_transmission.py.
"""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest
from numpy.testing import assert_allclose

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.optics.paths import ABOVE, Returned
from tests.support.directions import Array, polar
from tests.support.kinds import COATED, METAL, ON_SURFACE, lit
from tests.support.lanes import interaction
from tests.support.layered import BELOW, INDICES, PATCH, SIDES, both, load
from tests.support.stokes import REVERSAL, bases, matrices, rotation
from tests.support.variants import use


@pytest.fixture(autouse=True)
def without_kernels() -> None:
    use("scalar_spectral_polarized")


def few(*chosen: int) -> tuple[Array, Array, Array]:
    """Pairs: the first hundred are near the mirror direction."""
    wi, wo, lam = lit("metal", 200)
    return wi[[*chosen]], wo[[*chosen]], lam[[*chosen]]


def assert_each_close(found: Array, expected: Array, relative: float, of_largest: float) -> None:
    """Compare the matrices of each pair: far from the mirror direction there is less light."""
    for one, known in zip(found, expected, strict=True):
        assert_allclose(one, known, rtol=relative, atol=of_largest * known.max())


def test_an_interface_reflects_what_an_opaque_dielectric_does():
    light = few(8, -1)
    assert_each_close(matrices(both(), *light), matrices(load(**INDICES), *light), 1e-3, 1e-5)


@pytest.mark.parametrize("kind", SIDES)
def test_light_that_goes_through_has_the_transposed_matrix_in_reverse(kind):
    wi, wo, lam = few(8, -2, -1)
    wo, bsdf = wo * BELOW, both(**SIDES[kind])
    there, back = matrices(bsdf, wi, wo, lam), matrices(bsdf, wo, wi, lam)
    there, back = (m / np.abs(w[:, None, 2, None, None]) for m, w in ((there, wo), (back, wi)))
    # importance goes along ωi, and is not n² times as large in the dielectric
    adjoint = matrices(bsdf, wo, wi, lam, "Importance") / wi[:, None, 2, None, None]
    back = back / (2.25 if kind == "dielectric" else 1.0)
    after = rotation(bases(wo), bases(-wo), wo)[:, None]
    before = rotation(bases(-wi), bases(wi), -wi)[:, None]
    expected = REVERSAL @ there.swapaxes(-1, -2) @ REVERSAL
    assert_each_close(after @ back @ before, expected, 1e-4, 1e-5)
    assert_each_close(adjoint, there, 1e-4, 1e-5)


@pytest.mark.parametrize("theta", [40.0, 140.0])
@pytest.mark.parametrize("kind", SIDES)
def test_a_sample_tells_its_side_its_component_and_the_index_that_it_enters(kind, theta):
    bsdf, si = both(**SIDES[kind]), interaction(polar(theta, 20.0), 550.0)
    samples = [bsdf.sample(mi.BSDFContext(), si, n / 16, [0.3, 0.6])[0] for n in range(16)]
    passed = [one for one in samples if one.wo.z * si.wi.z < 0.0]
    assert 0 < len(passed) < len(samples)
    for one in samples:
        assert one.sampled_component == (one in passed)
        assert (one.sampled_type == +mi.BSDFFlags.GlossyTransmission) == (one in passed)
    eta = 1.0 if kind == "sheet" else 1.5 if theta < 90.0 else 1 / 1.5
    assert [one.eta for one in passed] == pytest.approx([eta] * len(passed))


def test_below_a_sheet_light_is_that_of_air_under_a_coat_in_a_mirror():
    wi, wo, lam = few(8, -2, -1)
    found = matrices(both(thin=True), wi * BELOW, wo * BELOW, lam)
    turned = md.HeightField(-PATCH.heights, PATCH.pixel_size)
    above = matrices(load(turned, eta=1.0, k=0.0, coat_ior=1.5), wi, wo, lam)
    flip = np.diag([1.0, 1.0, -1.0, -1.0])  # axes of the image are s and −p
    before = flip @ rotation(bases(-wo * BELOW), bases(-wo) * BELOW, -wo * BELOW)
    after = rotation(bases(wi) * BELOW, bases(wi * BELOW), wi * BELOW) @ flip
    expected = after[:, None] @ above @ before[:, None]
    assert_each_close(found, expected, 2e-3, 1e-4)


def test_a_sheet_s_flat_side_sends_back_orders_by_the_depths_of_both_passages():
    wi, wo, lam = few(-2, -1)  # far from order 0
    sheet = both(thin=True)
    found = matrices(sheet, wi, wo, lam) - matrices(load(**INDICES), wi, wo, lam)
    path, k, table = Returned(None, "", ABOVE, ABOVE, sheet=1.5), wavenumber(lam), sheet.table
    (u, v, _), *ends = (wi + wo).T[:, :, None], wi[:, 2:], wo[:, 2:]
    power = table.window_sum(k * u, k * v, k * path.width(*ends)) * (k * table.sigma) ** 2 / np.pi
    expected = power * path.common(*ends, 0.0) * wo[:, 2:]
    assert_allclose(found[..., 0, 0], expected, rtol=1e-3)


@pytest.mark.parametrize("coat", [METAL, COATED[0]], ids=["bare", "coat"])
def test_energy_scales_light_by_both_directions_outside(coat):
    (wi, wo, lam), bsdf = few(8, -1), load(**coat)
    plain = matrices(bsdf, wi, wo, lam)
    bsdf.energy.conserving = True
    bsdf.energy._scale = SimpleNamespace(at=lambda direction, site: [direction.z] * 4)
    expected = plain * (wi[:, 2] * wo[:, 2])[:, None, None, None]
    assert_allclose(matrices(bsdf, wi, wo, lam), expected, rtol=1e-5, atol=1e-9)


def test_options_of_other_kernels_are_told_apart():
    options = {}, {"shadowing": "vcavity"}, {"coat_ior": 1.58}, {"model": "kirchhoff"}, ON_SURFACE
    constants = [load(**METAL, **more).kernel_constants() for more in options]
    assert all(a != b for a, b in itertools.combinations(constants, 2))
    assert both().kernel_constants() != both(thin=True).kernel_constants()
