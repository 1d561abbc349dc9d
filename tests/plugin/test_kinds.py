"""Every kind of surface: its values are the reference's, in every variant, and its samples agree.

What follows for each wavelength alone is tried with one, whose kernels are a fourth as long.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, bsdf_dict, reference
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS, delta_e, linear_srgb, response
from mitsuba_diffraction.plugin import materials
from mitsuba_diffraction.tables.colour import ColourTable
from tests.support.directions import Array, polar, uniform_directions
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
from tests.support.lanes import evaluated, interaction, spectra, vectors
from tests.support.layered import PATCH, WIDTH, load, pairs
from tests.support.variants import ALL as EVERY
from tests.support.variants import SOME, evaluate, use

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


def bright() -> tuple[Array, Array, Array, Array]:
    """Incident and outgoing directions, wavelengths of the current variant, and samples."""
    wi, wo, lam = pairs()
    high = np.flatnonzero(np.minimum(wi[:, 2], wo[:, 2]) > 0.3)[::2]
    wi, wo, lam = wi[high], wo[high], lam[high]
    lam = lam if mi.is_spectral else np.full_like(lam, 600.0)
    return wi, wo, lam, np.random.default_rng(3).random((len(wi), 3))


RGB = [name for name in EVERY if "rgb" in name]


@pytest.mark.thorough
@pytest.mark.parametrize("name", RGB)
def test_colours_are_those_of_the_table(name: str) -> None:
    use(name)
    wi, wo, lam, samples = bright()
    value = evaluate(load(material="none"), wi, wo, samples, lam)[0]
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, tolerance=1e-4)
    u, v, w = (wi + wo).T
    outside = ((1.0 + (wi * wo).sum(axis=1)) / w) ** 2 / wi[:, 2]
    colours = ColourTable.build(table).colour(u, v, w)
    truth = 4.0 * np.pi * table.sigma**2 * outside[:, None] * colours
    # colours of a table lack the lobe of order 0 as the horizon sees it
    far = np.hypot(u, v) > 0.6
    # single precision: a phase of some hundred radians across the window has an error of 1e-4
    assert value[far] == pytest.approx(truth[far], rel=2e-3, abs=2e-5 * np.abs(truth).max())


@pytest.mark.thorough
def test_in_rgb_a_channel_has_the_boundary_of_one_wavelength() -> None:
    use("llvm_ad_rgb")
    wi, wo, lam = pairs(24)
    samples = np.full((len(wi), 3), 0.5)
    small, mirror = (
        evaluate(load(**given), wi, wo, samples, lam)[0] for given in ({}, {"material": "none"})
    )
    for n, one in enumerate(RGB_WAVELENGTHS):
        exact, perfect = (
            reference.brdf(PATCH, wi, wo, one, coherence_width=WIDTH, **given)
            for given in ({"model": "small_slope", "eta": 1.5 / 1.000277}, {})
        )
        bright = (perfect > 1e-4 * perfect.max()) & (np.abs(mirror[:, n]) > 1e-4 * mirror.max())
        assert bright.sum() > len(wi) // 4
        found = small[bright, n] / mirror[bright, n]
        assert found == pytest.approx((exact / perfect)[bright], rel=1e-3)


@pytest.mark.thorough
def test_gold_has_the_colour_of_its_spectrum(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearer than with one reflectance a channel, which lines of light do not all share."""
    use("llvm_ad_spectral")  # scalar variants would take minutes
    wi, wo, *_ = bright()
    lines = np.arange(362.5, 780.0, 5.0, np.float32).reshape(-1, 4)
    bsdf, truth = load(material="Au"), np.zeros((len(wi), 3))
    for group in lines:
        si = interaction(wi, np.tile(group, (len(wi), 1)))
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))).T
        truth += 5.0 * value @ linear_srgb(response(group))
    use("llvm_ad_rgb")
    errors = []
    for tinted in (True, False):
        with monkeypatch.context() as patch:
            if not tinted:
                patch.setattr(materials, "metal_tint", lambda *_: np.eye(3))
            si = interaction(wi, lines)
            found = np.array(load(material="Au").eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))).T
        errors.append(delta_e(truth, found, least=1e-3))
    assert np.nanmean(errors[0]) < 0.7 * np.nanmean(errors[1])


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("options", "low", "high", "side", "index"),
    [
        pytest.param({"material": "none"}, 70, 80, 1, 1.0, id="reflected"),
        pytest.param({"type": "diffraction_dielectric"}, 0, 60, -1, 1.5, id="refracted"),
        pytest.param({"type": "diffraction_dielectric", "thin": True}, 0, 60, -1, 1.0, id="sheet"),
    ],
)
def test_orders_of_one_window_interfere_in_colours_as_in_a_spectrum(
    options: dict[str, Any], low: float, high: float, side: int, index: float
) -> None:
    """Beats go with the factors of both: of order 0, and of the others."""
    ramp = np.tile(np.linspace(0.0, 0.3, 50), (8, 1))
    field = HeightField(ramp, 0.05, periodic=True)
    patch = {"coherence": "patch", "coherence_width": 3.0, "energy_conserving": False}
    surface = bsdf_dict(field, **patch, **options)
    rng, lines = np.random.default_rng(5), np.arange(378.0, 738.0, 2.0)
    wi = np.array([polar(*rng.uniform((low, 0), (high, 360))) for _ in range(20)])
    x, y = (rng.normal(0.0, 0.1, (20, 2)) - wi[:, :2] / index).T
    wo = np.stack([x, y, side * np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))], axis=1)
    mi.set_variant("llvm_ad_spectral")
    si = interaction(np.repeat(wi, 45, axis=0), np.tile(lines.reshape(-1, 4), (20, 1)))
    value = mi.load_dict(surface).eval(mi.BSDFContext(), si, vectors(np.repeat(wo, 45, axis=0)))
    colours = linear_srgb(response(lines))
    truth = spectra(value).reshape(20, 180) @ (colours / colours.sum(axis=0))
    mi.set_variant("llvm_ad_rgb")
    si = interaction(wi, np.zeros((20, 4)))
    found = np.array(mi.load_dict(surface).eval(mi.BSDFContext(), si, vectors(wo))).T
    # rings and series of colours, 0.4 %; light let through is 0.9 % off without its beats
    assert np.abs(found - truth).mean() < 0.006 * truth.mean()
