"""Every kind of surface once: its values are the reference's, its samples and densities agree.

Other tests of this folder ask more of each; they are run by `make test-all`.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from tests.support.directions import Array, as_single
from tests.support.layered import PATCH, WIDTH, load, pairs
from tests.support.transmitting import BELOW, INDICES, SIDES, both
from tests.support.variants import evaluate, runs

METAL = {"eta": 0.9, "k": 6.0}
GLASS = {"model": "small_slope", "eta": 1.5}
FILM = {"film_ior": 1.77, "film_thickness": 250.0}
PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}}
SCALES = np.full((2, 2, 1), 0.7, np.float32)

#: Parameters of the plugin, and of the reference where it knows the kind.
KINDS: dict[str, tuple[dict[str, Any], dict[str, Any] | None]] = {
    "mirror": ({"material": "none"}, {}),
    "dielectric": (INDICES, GLASS),
    "metal": (METAL, METAL | {"model": "small_slope"}),
    "coat": (METAL | {"coat_ior": 1.58}, METAL | {"model": "small_slope", "coat": 1.58}),
    "film": (METAL | FILM, METAL | {"model": "small_slope", "film": (1.77, 250.0)}),
    "pigment": (INDICES | {"pigment": PIGMENT}, None),
    "height scales": ({"material": "none", "height_scale": {"type": "bitmap", "raw": True}}, None),
    "surface": ({"material": "none", "coherence": "surface", "uv_scale": 10.0}, None),
}  # fmt: skip

#: Of places on the surface there is no light without wavelengths.
COLOURED = [kind for kind in KINDS if kind != "surface"]


def made(kind: str) -> Any:
    """The BSDF of a kind, in the variant that is set."""
    parameters = dict(KINDS[kind][0])
    if kind == "height scales":
        parameters["height_scale"] = parameters["height_scale"] | {"data": mi.TensorXf(SCALES)}
    return load(wavelength=600.0, **parameters)


def named(kind: str) -> Any:
    """The BSDF of a kind that reflects or transmits, or a mix, in the variant that is set."""
    if kind == "blended patches":
        one = md.bsdf_dict(PATCH, coherence_width=WIDTH, material="none", energy_conserving=False)
        return mi.load_dict({"type": "diffraction_mix", "one": one, "two": one, "weight_one": 0.3})
    return both(**SIDES[kind]) if kind in SIDES else made(kind)


def checked(bsdf: Any, wo: Array, light: tuple[Array, Array]) -> Array:
    """Values, the same by `eval` and `eval_pdf`; the samples' weights are values over densities."""
    wi, lam = light
    samples = as_single(np.random.default_rng(2).random((len(wi), 3)))
    value, pdf, again, pdf_again, drawn, density, weight = evaluate(bsdf, wi, wo, samples, lam)
    assert np.all(np.isfinite(value))
    assert np.any(value > 0.0)
    assert again == pytest.approx(value, rel=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-5)
    assert np.all(np.isfinite(weight))
    assert np.all(np.isfinite(density))
    assert np.linalg.norm(drawn[density > 0.0], axis=1) == pytest.approx(1.0, abs=1e-5)
    return value


def lit(count: int) -> tuple[Array, Array, Array]:
    wi, wo, lam = (part[:count] for part in pairs())
    return wi, wo, lam


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_is_the_reference_s(some_variant, kind):
    wi, wo, lam = lit(60)
    value = checked(made(kind), wo, (wi, lam))
    theirs = KINDS[kind][1]
    if theirs is not None:
        columns = [
            reference.brdf(PATCH, wi, wo, one, coherence_width=WIDTH, **theirs) for one in lam.T
        ]
        exact = np.stack(columns, axis=1) * wo[:, 2:]
        # the table's tolerance where light is scarce; 1e-3 of every value elsewhere
        assert value == pytest.approx(exact, rel=1e-3, abs=1e-5 * exact.max())


@pytest.mark.parametrize("kind", SIDES)
def test_a_kind_that_lets_light_through_is_the_reference_s(some_variant, kind):
    wi, wo, lam = lit(60)
    value = checked(both(**SIDES[kind]), as_single(wo * BELOW), (wi, lam))
    columns = [
        reference.btdf(
            PATCH, wi, wo * BELOW, one,
            coherence_width=WIDTH, model="small_slope", eta=1.5, thin=kind == "sheet",
        )
        for one in lam.T
    ]  # fmt: skip
    exact = np.stack(columns, axis=1) * wo[:, 2:]
    assert value == pytest.approx(exact, rel=1e-3, abs=1e-5 * exact.max())


@pytest.mark.parametrize("kind", [*COLOURED, *SIDES, "blended patches"])
def test_a_kind_agrees_with_itself_in_colours_without_kernels(kind):
    if not runs("scalar_rgb"):
        pytest.skip("scalar_rgb is not here")
    mi.set_variant("scalar_rgb")
    wi, wo, lam = lit(4)
    checked(named(kind), wo, (wi, lam))


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
@pytest.mark.parametrize("kind", ["metal", "dielectric", "sheet", "blended patches"])
def test_directions_and_samples_are_taken_as_lists(variant, kind):
    if not runs(variant):
        pytest.skip(f"{variant} is not here")
    mi.set_variant(variant)
    bsdf = named(kind)
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.0, 0.0, 1.0)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0.0, 0.0, 1.0))
    ctx, wo, pair = mi.BSDFContext(), [0.1, 0.0, 0.995], [0.3, 0.4]
    for name in ("eval", "pdf", "eval_pdf"):
        function = getattr(bsdf, name)
        assert str(function(ctx, si, wo)) == str(function(ctx, si, mi.Vector3f(wo)))
    drawn, weight = bsdf.sample(ctx, si, 0.5, pair)
    again, expected = bsdf.sample(ctx, si, mi.Float(0.5), mi.Point2f(pair))
    assert (str(drawn.wo), str(weight)) == (str(again.wo), str(expected))
