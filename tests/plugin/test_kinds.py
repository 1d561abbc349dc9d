"""Every kind of surface: its values are the reference's, in every variant, and its samples agree.

What follows for each wavelength alone is tried with one, whose kernels are a fourth as long.
"""

from __future__ import annotations

from itertools import product

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import polar, uniform_directions
from tests.support.furnace import sent_on
from tests.support.kinds import (
    KINDS,
    MIX,
    MIXED_SHEETS,
    MORE,
    THROUGH,
    check,
    check_matrices,
    lit,
    made,
)
from tests.support.lanes import evaluated
from tests.support.variants import SOME, use

#: Of places on the surface there is no light without wavelengths.
COLOURED = [kind for kind in KINDS if "surface" not in kind]
THOROUGH = [pytest.param(kind, marks=pytest.mark.thorough) for kind in (*MORE, MIX, MIXED_SHEETS)]
ALL = [*KINDS, *MORE, *THROUGH, MIX, MIXED_SHEETS]
KNOWN = [name for name, kind in (KINDS | MORE).items() if kind.reference is not None]
#: Layers that lose light also where the bare model, without conservation of energy, gains some.
LOSING = [kind for kind in KINDS | MORE if kind.startswith(("coat", "film"))]
#: Each kind in one variant, each variant with some kinds; of places, those with wavelengths.
ELSEWHERE = [(SOME[n % len(SOME)], kind) for n, kind in enumerate(ALL) if "surface" not in kind]
ELSEWHERE += product([v for v in SOME if "rgb" not in v], [k for k in ALL if "surface" in k])


@pytest.mark.parametrize("kind", [*KINDS, *THROUGH, *THOROUGH])
def test_a_kind_is_the_reference_s(some_variant, kind):
    check(kind, 60)


@pytest.mark.parametrize("kind", [*COLOURED, *THROUGH, MIX])
def test_a_kind_agrees_with_itself_in_colours_without_kernels(kind):
    use("scalar_rgb")
    check(kind, 4)


@pytest.mark.parametrize("kind", KNOWN)
def test_matrices_of_a_kind_are_the_reference_s(kind):
    use("scalar_spectral_polarized")
    check_matrices(kind)


@pytest.mark.parametrize("kind", ["metal", *THROUGH, MIX])
@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_directions_and_samples_are_taken_as_lists(variant, kind):
    use(variant)
    bsdf = made(kind)
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.0, 0.0, 1.0)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0.0, 0.0, 1.0))
    ctx, wo, pair = mi.BSDFContext(), [0.1, 0.0, 0.995], [0.3, 0.4]
    functions = bsdf.eval, bsdf.pdf, bsdf.eval_pdf
    lists, arrays = (
        [[f(ctx, si, direction) for f in functions], bsdf.sample(ctx, si, one, two)]
        for direction, one, two in (
            (wo, 0.5, pair), (mi.Vector3f(wo), mi.Float(0.5), mi.Point2f(pair)),
        )
    )  # fmt: skip
    dr.eval(lists, arrays)  # one kernel
    assert str(lists) == str(arrays)


@pytest.mark.thorough
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


@pytest.mark.thorough
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


@pytest.mark.thorough
@pytest.mark.parametrize("kind", [*KINDS, *MORE, MIX])
def test_samples_have_all_the_light_of_the_values(mono, kind):
    bsdf, count = made(kind), 1 << 14
    wo = uniform_directions(count, np.random.default_rng(1), 0.0)
    for theta in (0.0, 45.0, 75.0):
        weights = sent_on(bsdf, polar(theta)[None], 0, 550.0, samples=count)[0, 0]
        error = weights.std() / np.sqrt(count)
        if kind in LOSING:
            assert weights.mean() < 1.0 + 3 * error
        share = 2.0 * np.pi * evaluated(bsdf, polar(theta), wo, 550.0)[:, 0]
        spread = np.hypot(error, share.std() / np.sqrt(count))
        assert abs(weights.mean() - share.mean()) < 4 * spread  # 1 in 16 000


@pytest.mark.thorough
@pytest.mark.parametrize(("variant", "kind"), ELSEWHERE)
def test_a_kind_is_alike_in_every_variant(variant, kind):
    use(variant)
    check(kind, 16)
