"""The second order in the plugin: against the reference and its NumPy twin; what it refuses."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics import blend, second_order
from mitsuba_diffraction.optics.geometry import sigma_of, wavenumber
from mitsuba_diffraction.reference import boundary
from tests.support.directions import lit_pairs, polar, rough_patch
from tests.support.lanes import brdf_values, interaction, refusal, vectors

# a patch this small is beyond what the model likes; that is not the point here
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]

#: Of 1.7 × 1.76 µm, its orders far apart under the window.
PATCH = rough_patch((22, 20), (0.085, 0.08), 0.1)
WIDTH = 16.0
KERATIN = {
    "int_ior": 1.56, "ext_ior": 1.0, "coherence_width": WIDTH, "tolerance": 1e-3,
    "energy_conserving": False, "second_order": True,
}  # fmt: skip


def load(field=PATCH, **parameters):
    return mi.load_dict(md.bsdf_dict(field, **{**KERATIN, **parameters}))


def coloured():
    """Directions and wavelengths in the lobes of other orders than 0."""
    wi, wo, lam, near = lit_pairs(PATCH, sigma_of(WIDTH), 160, 1)
    return wi[~near], wo[~near], lam[~near]


def reference(light, eta=1.56, **parameters):
    return md.reference.brdf(
        PATCH, *light, coherence_width=WIDTH, model="small_slope", eta=eta, **parameters
    )


@pytest.mark.parametrize(
    ("ours", "theirs"), [({}, {}), ({"coat_ior": 1.4, "int_ior": 2.2}, {"coat": 1.4, "eta": 2.2})]
)
def test_orders_have_the_reference_s_power(variant, ours, theirs):
    light = coloured()
    first, both = (reference(light, second_order=second, **theirs) for second in (False, True))
    change = np.abs(both - first).sum()
    assert change > 0.002 * first.sum()  # light in a coat is steeper
    # c is interpolated between angles, r between κ
    found = load(**{"tolerance": 1e-4, **ours})
    assert np.abs(brdf_values(found, *light) - both).sum() < 0.12 * change


def test_auto_applies_it_where_it_changes_the_table_s_colours(variant):
    light = coloured()
    grooves = md.gratings.lamellar(1.6, 0.125, duty=0.6875, periods=1, pixels_per_period=32)
    for field, applied in ((PATCH, False), (grooves, True)):
        auto, told = (load(field, second_order=second) for second in ("auto", applied))
        assert (auto.table.slope_ratios.change >= 0.05) is applied
        second = auto.describe().second_order
        assert (second is not None and second.index == 1.56) is applied
        assert np.array_equal(brdf_values(auto, *light), brdf_values(told, *light))


def test_auto_leaves_out_what_it_is_not_known_for(variant):
    for one in (
        {"model": "kirchhoff"}, {"coherence": "patch"},
        {"film_ior": 1.6, "film_thickness": 100.0}, {"int_ior": 1.0, "ext_ior": 1.5},
        {"material": "Al", "int_ior": None, "ext_ior": None},
    ):  # fmt: skip
        bsdf = load(second_order="auto", **one)
        assert "second order" not in bsdf.model
        assert bsdf.table.slope_ratios is None  # nothing is built for nothing


@pytest.mark.parametrize("scale", [1.0, 0.6])
def test_the_factor_is_that_of_its_numpy_twin(variant, scale):
    wi, wo, lam = light = coloured()
    bsdf, plain = load(height_scale=scale), load(height_scale=scale, second_order=False)
    wave = wavenumber(lam)
    q, kappa = wave[:, None] * (wi + wo)[:, :2], wave * (wi + wo)[:, 2] * scale
    roughness = blend.ScaleRoughness.from_heights(scale * PATCH.heights, PATCH.pixel_size)
    share = boundary.small_slope_weight(kappa / scale, roughness.at(np.hypot(*q.T)), 1.56)
    ratios = scale**2 * bsdf.table.slope_ratios.at(q, kappa)
    factor = second_order.factor(second_order.interpolated(1.56, wi, wo), ratios, share)
    found, first = brdf_values(bsdf, *light), brdf_values(plain, *light)
    strong = first > 1e-4 * first.max()  # where order 0's tail is none
    # half floats of r, and single precision of angles
    assert found[strong] == pytest.approx(factor[strong] * first[strong], rel=3e-3)
    assert found.max() < 2.26 * first.max()


def test_it_is_reciprocal_and_leaves_the_mirror_direction(variant):
    bsdf, plain = load(), load(second_order=False)
    wi, wo, lam = coloured()
    there, back = brdf_values(bsdf, wi, wo, lam), brdf_values(bsdf, wo, wi, lam)
    assert there == pytest.approx(back, rel=1e-4, abs=1e-5 * there.max())
    mirrored = polar(40.0)[None], polar(40.0, 180.0)[None], [550.0]
    assert brdf_values(bsdf, *mirrored) == pytest.approx(brdf_values(plain, *mirrored), rel=1e-4)


@pytest.mark.parametrize("theta", [0.0, 60.0, 85.0])
def test_directions_are_drawn_as_without_it_and_light_is_kept(variant, theta):
    si, n = interaction(np.tile(polar(theta, 30.0), (1 << 15, 1)), 550.0), 1 << 15
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, n)
    numbers = sampler.next_1d(), sampler.next_2d()
    drawn, weights = zip(
        *(
            load(second_order=second).sample(mi.BSDFContext(), si, *numbers)
            for second in (False, True)
        ),
        strict=True,
    )
    assert np.array_equal(drawn[0].pdf, drawn[1].pdf)
    without, found = (np.array(one)[0] for one in weights)
    assert found.mean() == pytest.approx(without.mean(), abs=0.005)
    assert np.all(found <= 2.2501 * without + 1e-9)


@pytest.mark.parametrize("name", ["scalar_spectral", "llvm_ad_rgb"])
def test_other_variants_have_it_too(name):
    mi.set_variant("llvm_ad_spectral")
    spectral, changed = _of_one()
    assert np.all(np.abs(changed / spectral - 1.0) > 0.01)
    mi.set_variant(name)
    first, found = _of_one()
    if mi.is_spectral:
        assert found == pytest.approx(changed, rel=1e-3)
    else:  # of the channels' mean wavelengths, 450 to 610 nm
        assert found / first == pytest.approx(np.mean(changed / spectral), abs=0.02)


def _of_one():
    """f·cosθo of one pair of directions, without it and with it, for each channel."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, wo = (mi.Vector3f(w.tolist()) for w in (polar(60.0), polar(31.0, 176.0)))
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    if mi.is_spectral:
        si.wavelengths = [460.0, 510.0, 560.0, 610.0]
    bsdfs = (load(second_order=second, coherence_width=6.0) for second in (False, True))
    return [np.array(bsdf.eval(mi.BSDFContext(), si, wo), float).ravel() for bsdf in bsdfs]


def test_derivatives_of_the_height_scale_are_those_of_differences(variant):
    wi, wo, _ = coloured()
    si, outgoing = interaction(wi, [[480.0, 540.0, 600.0, 660.0]]), vectors(wo)
    bsdf = load()
    parameters = mi.traverse(bsdf)

    def total(value, differentiable=False):
        parameters["height_scale"] = mi.Float(value)
        if differentiable:
            dr.enable_grad(parameters["height_scale"])
        parameters.update()
        return dr.sum(dr.sum(bsdf.eval(mi.BSDFContext(), si, outgoing)))

    step = 2e-3
    expected = (total(0.9 + step)[0] - total(0.9 - step)[0]) / (2 * step)
    value = total(0.9, differentiable=True)
    dr.backward(value)
    found = parameters["height_scale"].grad[0]
    assert found == pytest.approx(expected, rel=2e-3)
    assert found != pytest.approx(0.0)


def test_another_index_has_other_coefficients(variant):
    light = coloured()
    bsdf = load()
    parameters = mi.traverse(bsdf)
    parameters["eta"] = mi.Float(1.8)
    parameters.update()
    assert brdf_values(bsdf, *light) == pytest.approx(
        brdf_values(load(int_ior=1.8), *light), rel=1e-5
    )


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"material": "Al", "int_ior": None, "ext_ior": None}, "a conductor"),
        ({"model": "kirchhoff"}, "model='kirchhoff'"),
        ({"coherence": "patch"}, "coherence='patch'"),
        ({"coat_ior": 1.6}, "below the index of the medium above"),
        ({"film_ior": 1.6, "film_thickness": 100.0}, "film_ior"),
        ({"plugin": "diffraction_dielectric"}, "'diffraction_dielectric'"),
    ],
)
def test_what_it_is_not_for_is_refused_by_name(variant, changed, named):
    line = refusal(lambda: load(second_order=True, **changed))
    assert "second_order" in line
    assert named in line


def test_a_table_without_it_is_refused_with_what_makes_one(variant, tmp_path):
    for name, asked in (("without.exr", False), ("with.exr", True)):
        md.DiffractionTable.build(PATCH, coherence_width=WIDTH, second_order=asked).save(
            tmp_path / name
        )
    asked = {"coherence_width": None, "tolerance": None, "second_order": None}
    line = refusal(lambda: load(str(tmp_path / "without.exr"), **asked | {"second_order": True}))
    assert "second_order=" in line
    light = coloured()
    assert brdf_values(load(str(tmp_path / "without.exr"), **asked), *light) == pytest.approx(
        brdf_values(load(second_order=False), *light), rel=1e-3, abs=1e-6
    )
    from_file = load(str(tmp_path / "with.exr"), **asked)
    assert brdf_values(from_file, *light) == pytest.approx(
        brdf_values(load(), *light), rel=1e-3, abs=1e-6
    )
    without = load(str(tmp_path / "with.exr"), **asked | {"second_order": False})
    assert without.describe().second_order is None
    assert from_file.describe().second_order.index == 1.56


def test_a_recorded_function_keeps_it(variant):
    wi, wo, _ = coloured()
    si, outgoing = interaction(wi, [[480.0, 540.0, 600.0, 660.0]]), vectors(wo)

    @dr.freeze
    def frozen(bsdf):
        return bsdf.eval(mi.BSDFContext(), si, outgoing)

    for parameters in ({}, {}, {"second_order": False}, {"int_ior": 1.8}):
        bsdf = load(**parameters)
        expected = np.array(bsdf.eval(mi.BSDFContext(), si, outgoing))
        assert np.array(frozen(bsdf)) == pytest.approx(expected, rel=1e-5)
