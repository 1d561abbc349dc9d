"""Every kind of surface once: its values are the reference's, its samples and densities agree.

test_kinds_thorough.py asks more of each, and of more kinds.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import as_single
from tests.support.kinds import KINDS, MIX, THROUGH, exact, lit, made
from tests.support.variants import evaluate, runs

#: Of places on the surface there is no light without wavelengths.
COLOURED = [kind for kind in KINDS if "surface" not in kind]


def check(kind: str, count: int) -> None:
    """Values, the same by `eval` and `eval_pdf`; samples are as dense and bright as these say."""
    wi, wo, lam = lit(kind, count)
    samples = as_single(np.random.default_rng(2).random((len(wi), 3)))
    bsdf = made(kind)
    value, pdf, again, pdf_again, drawn, density, weight = evaluate(bsdf, wi, wo, samples, lam)
    assert np.all(np.isfinite(value))
    assert np.any(value > 0.0)
    assert again == pytest.approx(value, rel=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-5)
    assert np.all(np.isfinite(weight))
    assert np.all(np.isfinite(density))
    valid = density > 0.0
    assert np.linalg.norm(drawn[valid], axis=1) == pytest.approx(1.0, abs=1e-5)
    there, dense, *_ = evaluate(bsdf, wi, np.where(valid[:, None], drawn, wo), samples, lam)
    assert density[valid] == pytest.approx(dense[valid], rel=1e-3)
    product = (weight * density[:, None])[valid]
    assert product == pytest.approx(there[valid], rel=2e-3, abs=1e-5 * np.abs(there).max())
    if kind == "pigment":
        parts = (evaluate(bsdf, wi, wo, samples, lam, component)[0] for component in (0, 1))
        assert sum(parts) == pytest.approx(value, rel=1e-5)
    if mi.is_spectral and (expected := exact(kind, wi, wo, lam)) is not None:
        # the table's tolerance where light is scarce; 1e-3 of every value elsewhere
        assert value == pytest.approx(expected, rel=1e-3, abs=1e-5 * expected.max())


@pytest.mark.parametrize("kind", [*KINDS, *THROUGH])
def test_a_kind_is_the_reference_s(some_variant, kind):
    check(kind, 60)


@pytest.mark.parametrize("kind", [*COLOURED, *THROUGH, MIX])
def test_a_kind_agrees_with_itself_in_colours_without_kernels(kind):
    if not runs("scalar_rgb"):
        pytest.skip("scalar_rgb is not here")
    mi.set_variant("scalar_rgb")
    check(kind, 4)


@pytest.mark.parametrize("kind", ["metal", *THROUGH, MIX])
@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_directions_and_samples_are_taken_as_lists(variant, kind):
    if not runs(variant):
        pytest.skip(f"{variant} is not here")
    mi.set_variant(variant)
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
