"""Every kind of surface, and more of them: reciprocal, sampled as it is, alike in every variant.

What follows for each wavelength alone is tried with one, whose kernels are a fourth as long.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.support.directions import Array, as_single, polar
from tests.support.kinds import KINDS, MIX, MIXED_SHEETS, MORE, THROUGH, exact, lit, made
from tests.support.lanes import evaluated, interaction
from tests.support.variants import SOME, evaluate, runs

pytestmark = pytest.mark.thorough

ALL = [*KINDS, *MORE, *THROUGH, MIX, MIXED_SHEETS]
#: Layers that lose light also where the bare model, without conservation of energy, gains some.
LOSING = [kind for kind in KINDS | MORE if kind.startswith(("coat", "film"))]
# each kind in one variant, each variant with some kinds, without places in colours
ELSEWHERE = [(SOME[n % len(SOME)], kind) for n, kind in enumerate(ALL) if "surface" not in kind]


@pytest.mark.parametrize(
    "kind", [*(kind for kind in MORE if MORE[kind].reference is not None), MIXED_SHEETS]
)
def test_values_are_the_reference_s(some_variant, kind):
    wi, wo, lam = lit(kind, 120)
    bsdf, expected = made(kind), exact(kind, wi, wo, lam)
    # the table's tolerance where light is scarce; 1e-3 of every value elsewhere
    bound = {"rel": 1e-3, "abs": 1e-5 * expected.max()}
    assert evaluated(bsdf, wi, wo, lam) == pytest.approx(expected, **bound)


@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
@pytest.mark.parametrize("kind", ["metal", "dielectric"])
def test_layers_that_are_none_leave_the_surface_bare(mono, kind, model):
    wi, wo, lam = lit(kind, 60)
    bare = evaluated(made(kind, model=model), wi, wo, lam)
    for layer in (
        {"coat_ior": 1.0},
        {"film_ior": 1.8, "film_thickness": 0.0},
        {"film_ior": 1.0, "film_thickness": 300.0},
    ):
        covered = evaluated(made(kind, model=model, **layer), wi, wo, lam)
        # of sums that cancel, in single precision
        assert covered == pytest.approx(bare, rel=5e-5, abs=2e-6 * bare.max())


@pytest.mark.parametrize("kind", ALL)
def test_reciprocity(mono, kind):
    wi, wo, lam = lit(kind, 200)
    bsdf = made(kind)
    there = evaluated(bsdf, wi, wo, lam) / np.abs(wo[:, 2:])
    back = evaluated(bsdf, wo, wi, lam) / np.abs(wi[:, 2:])
    # radiance in the dielectric is n² times as large
    factor = 2.25 if kind.endswith("dielectric") and kind in THROUGH else 1.0
    # amplitudes of one place, and of what goes through, cancel in single precision
    cancels = 2.0 if kind.startswith(("surface", "one window", "through")) else 1.0
    bound = {"rel": 1e-4 * cancels, "abs": 1e-6 * cancels * back.max()}
    assert factor * there == pytest.approx(back, **bound)


@pytest.mark.parametrize("kind", [*KINDS, *MORE, MIX])
def test_samples_are_those_of_the_density_and_have_the_light_of_the_values(mono, kind):
    bsdf, count = made(kind), 1 << 14
    for theta in (0.0, 45.0, 75.0):
        si = interaction(np.tile(as_single(polar(theta)), (count, 1)), 550.0)
        rng = mi.PCG32(count)
        one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        sample, weight = bsdf.sample(mi.BSDFContext(), si, one, two)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, sample.wo)
        uniform = mi.warp.square_to_cosine_hemisphere(two)
        elsewhere = bsdf.eval(mi.BSDFContext(), si, uniform)
        dr.eval(sample, weight, value, pdf, uniform, elsewhere)  # one kernel instead of five
        weights: Array = np.array(weight, float)[0]
        valid = np.array(sample.pdf) > 0.0
        # not pytest.approx, which takes half a second for so many numbers
        assert_allclose(np.array(sample.pdf)[valid], np.array(pdf)[valid], rtol=1e-4)
        expected = np.array(value, float)[0][valid]
        assert_allclose((weights * np.array(pdf))[valid], expected, rtol=5e-4, atol=5e-7)
        error = weights.std() / np.sqrt(count)
        if kind in LOSING:
            assert weights.mean() < 1.0 + 3 * error
        share = np.array(elsewhere, float)[0] / np.maximum(
            np.array(mi.Frame3f.cos_theta(uniform)) / np.pi, 1e-6
        )
        spread = np.hypot(error, share.std() / np.sqrt(count))
        assert abs(weights.mean() - share.mean()) < 4 * spread  # 1 in 16 000


@pytest.mark.parametrize(("variant", "kind"), ELSEWHERE)
def test_a_kind_is_alike_in_every_variant(variant, kind):
    if not runs(variant):
        pytest.skip(f"{variant}: Dr.Jit finds no device for it")
    mi.set_variant(variant)
    wi, wo, _ = lit(kind, 16)
    lam = np.full((len(wi), 4), 600.0)
    samples = as_single(np.random.default_rng(2).random((len(wi), 3)))
    value, pdf, again, pdf_again, *_ = evaluate(made(kind), wi, wo, samples, lam)
    assert np.all(np.isfinite(value))
    assert again == pytest.approx(value, rel=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-5)
    expected = None if mi.is_rgb else exact(kind, wi, wo, lam[:, :1])
    if expected is not None:
        assert value[:, :1] == pytest.approx(expected, rel=1e-3, abs=1e-5 * expected.max())
