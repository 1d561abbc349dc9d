"""The BSDF as Mitsuba sees it: values, frames, nesting, parameters that change, registration."""

from __future__ import annotations

import os
import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.geometry import sigma_of, wavenumber
from tests.conftest import ROOT
from tests.lanes import brdf_values, evaluated, interaction, spectra, vectors
from tests.optics import lit_pairs, polar, rough_patch

#: 4.76 × 5.28 µm, gentle, its pixels and its numbers of them unequal: nothing is symmetric.
PATCH = rough_patch((66, 56), (0.085, 0.08), 0.08)
WIDTH = 4.5


def load(field=PATCH, **parameters):
    """The plugin as a perfect reflector and the raw model, unless told otherwise."""
    if not {"material", "int_ior", "eta"} & set(parameters):
        parameters["material"] = "none"
    raw = {"energy_conserving": False, "coherence_width": WIDTH}
    return mi.load_dict(md.bsdf_dict(field, **(raw | parameters)))


def pairs(n=200, seed=1, field=PATCH):
    """Directions and wavelengths where light goes."""
    return lit_pairs(field, sigma_of(WIDTH), n, seed)[:3]


# ------------------------------------------------------------------------ values


@pytest.mark.parametrize("basis", ["svd", "chebyshev", "taylor"])
@pytest.mark.parametrize("coherence", md.reference.COHERENCES)
def test_the_plugin_is_its_table(variant, coherence, basis):
    bsdf = load(coherence=coherence, basis=basis, tolerance=1e-4)
    wi, wo, lam = pairs()
    expected = bsdf.table.brdf(wi, wo, lam)
    value = brdf_values(bsdf, wi, wo, lam[:, None])
    # single precision in phases: positions of up to 50 bins to 1e-5 of one, under Gaussians whose
    # exponents are at most 10 times that far from the centre
    assert np.sum(np.abs(value - expected)) < 3e-6 * np.sum(expected)
    assert value == pytest.approx(expected, rel=1e-3, abs=1e-5 * expected.max())


def test_swapping_directions_changes_nothing(variant):
    wi, wo, lam = pairs()
    for parameters in ({}, {"int_ior": 1.5}, {"material": "Al"}, {"coherence": "patch"}):
        bsdf = load(**parameters)
        there, back = (
            brdf_values(bsdf, wi, wo, lam[:, None]),
            brdf_values(bsdf, wo, wi, lam[:, None]),
        )
        assert there == pytest.approx(back, rel=1e-5)


def test_nothing_is_reflected_from_or_to_below(variant):
    bsdf = load()
    wi, wo, lam = pairs()
    down = [1, 1, -1]
    for incident, outgoing in ((wi, wo * down), (wi * down, wo), (wi * down, wo * down)):
        assert np.array_equal(evaluated(bsdf, incident, outgoing, lam[:, None]), np.zeros((200, 4)))
        si = interaction(incident, lam[:, None])
        pdf = np.array(bsdf.pdf(mi.BSDFContext(), si, vectors(outgoing)))
        assert np.array_equal(pdf, np.zeros(200))


def test_masked_lanes_are_zero(variant):
    bsdf = load()
    wi, wo, lam = pairs()
    active = mi.Mask(np.arange(200) % 2 == 0)
    si, context = interaction(wi, lam[:, None]), mi.BSDFContext()
    value = spectra(bsdf.eval(context, si, vectors(wo), active))
    assert np.all(value[1::2] == 0)
    # a cut series may dip below zero where it is dark, and is 0 there
    assert np.mean(value[::2].sum(axis=1) > 0) > 0.95
    assert np.all(np.array(bsdf.pdf(context, si, vectors(wo), active))[1::2] == 0)
    sample, weight = bsdf.sample(context, si, 0.3, mi.Point2f(0.2, 0.4), active)
    assert np.all(spectra(weight)[1::2] == 0)
    assert np.all(np.array(sample.pdf)[1::2] == 0)


def test_a_flat_mirror_s_albedo_is_one(variant):
    flat = md.HeightField(np.zeros((800, 800)), 0.0815)  # 65.2 µm
    bsdf = mi.load_dict(md.bsdf_dict(flat, material="none", energy_conserving=False))
    wavelengths = [400.0, 480.0, 560.0, 700.0]
    for theta, allowed in [(0, 1e-3), (30, 1e-3), (45, 1e-3), (60, 1e-3), (75, 3e-3)]:
        wi = polar(theta, 20.0)
        for n, lam in enumerate(wavelengths):
            # ∫ f cosθo dωo = ∫ f du dv over the lobe, in steps of 1/4 of its width 1/(kσ)
            step = 0.25 / (float(wavenumber(lam)) * 16.25)
            u, v = (g.ravel() * step for g in np.meshgrid(*2 * [np.arange(-24, 25)]))
            tangential = np.stack([u, v], axis=1) - wi[:2]
            z2 = 1 - np.sum(tangential**2, axis=1)
            wo = np.concatenate([tangential, np.sqrt(np.maximum(z2, 0))[:, None]], axis=1)
            wo = wo[z2 > 1e-6]
            f = evaluated(bsdf, wi, wo, [wavelengths])[:, n] / wo[:, 2]
            # what the window's own width breaks, design section 7
            assert np.sum(f) * step**2 == pytest.approx(1.0, abs=allowed), (theta, lam)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_facet_that_descends_towards_a_tangent_reflects_towards_it(variant, axis):
    lam, period = 500.0, 2.0
    angle = np.degrees(np.arcsin(lam * 1e-3 / period))
    depth = lam * 1e-3 / (1 + np.cos(np.radians(angle)))  # one wavelength of path
    field = md.gratings.blazed(period, depth, axis="xy"[axis], periods=5, pixels_per_period=64)
    with pytest.warns(md.DiffractionWarning):  # of its steep flanks
        bsdf = mi.load_dict(
            md.bsdf_dict(field, material="none", coherence_width=10.0, energy_conserving=False)
        )
    towards, away = polar(angle, 90.0 * axis), polar(angle, 90.0 * axis + 180.0)
    lit, dark = evaluated(bsdf, polar(0), [towards, away], lam)[:, 0]
    assert lit > 1e3 * dark  # sinc² of 0 against sinc² of 2, and the tolerance


def test_the_ends_of_the_range_are_served(variant):
    # the shortest wavelength, straight up and down, at the largest scale: κ_max itself, rounded
    bsdf = load(height_scale=1.0)
    parameters = mi.traverse(bsdf)
    parameters["height_scale"] = bsdf.table.height_scale_max
    parameters.update()
    assert np.all(np.isfinite(evaluated(bsdf, polar(0), [polar(0)], 360.0)))
    # and |(u, v)| = 2, all but
    grazing = polar(89.99)
    assert np.all(np.isfinite(evaluated(bsdf, grazing, [grazing], 360.0)))


# ------------------------------------------------------------------------ frames


def test_orientation_turns_the_patch_anticlockwise(variant):
    # a patch turned by 90°: what lay along +x now lies along +y. The power of an ensemble does
    # not care where the turned patch starts.
    turned = md.HeightField(np.rot90(PATCH.heights, -1), PATCH.pixel_size[::-1])
    wi, wo, lam = pairs(field=turned)
    by_parameter = brdf_values(load(orientation=90.0, tolerance=1e-5), wi, wo, lam[:, None])
    by_hand = brdf_values(load(turned, tolerance=1e-5), wi, wo, lam[:, None])
    # both are built to 1e-5; sin and cos in single precision shift frequencies by 1e-7 of them
    assert np.sum(np.abs(by_parameter - by_hand)) < 2e-5 * np.sum(by_hand)
    unturned = brdf_values(load(), wi, wo, lam[:, None])
    dim = by_hand < 0.01 * by_hand.max()  # what is not the mirror's lobe, the same either way
    assert np.sum(np.abs(unturned - by_hand)[dim]) > 0.5 * np.sum(by_hand[dim])


def test_turning_the_sample_is_turning_the_lamp_and_the_eye_back(variant):
    angle = np.radians(37.0)
    rotation = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    wi, wo, lam = pairs()
    turned = brdf_values(load(orientation=37.0), wi @ rotation.T, wo @ rotation.T, lam[:, None])
    plain = brdf_values(load(), wi, wo, lam[:, None])
    # directions are rounded to 6e-8 after turning, by up to 1e-5 of a bin
    assert np.sum(np.abs(turned - plain)) < 1e-4 * np.sum(plain)


def test_a_blaze_turned_by_90_degrees_reflects_towards_the_second_tangent(variant):
    lam, period = 500.0, 2.0
    angle = np.degrees(np.arcsin(lam * 1e-3 / period))
    field = md.gratings.blazed(period, 0.2539, periods=5)
    with pytest.warns(md.DiffractionWarning):
        bsdf = mi.load_dict(
            md.bsdf_dict(
                field,
                material="none",
                coherence_width=10.0,
                orientation=90.0,
                energy_conserving=False,
            )
        )
    wo = [polar(angle, phi) for phi in (90, 0, 180, 270)]
    values = evaluated(bsdf, polar(0), wo, lam)[:, 0]
    assert values.argmax() == 0
    assert values[0] > 100 * values[1:].max()


def test_both_sides_of_a_sheet(variant):
    one, two = load(), mi.load_dict({"type": "twosided", "bsdf": load()})
    wi, wo, lam = pairs()
    front = evaluated(one, wi, wo, lam[:, None])
    assert np.array_equal(evaluated(two, wi, wo, lam[:, None]), front)
    back = evaluated(two, wi * [1, 1, -1], wo * [1, 1, -1], lam[:, None])
    assert np.array_equal(back, front)


# ------------------------------------------------------------------------ what lies beneath


def test_what_is_not_reflected_reaches_the_nested_bsdf(variant):
    pigment = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
    bare, coated = load(int_ior=1.5), load(int_ior=1.5, pigment=pigment)
    wi, wo, lam = pairs()
    context, si = mi.BSDFContext(), interaction(wi, lam[:, None])
    eta = 1.5 / 1.000277

    def transmittance(cos_theta):
        return 1 - np.array(mi.fresnel(mi.Float(cos_theta.astype(np.float32)), eta)[0])

    t = transmittance(wi[:, 2]) * transmittance(wo[:, 2])
    beneath = spectra(mi.load_dict(pigment).eval(context, si, vectors(wo)))
    expected = evaluated(bare, wi, wo, lam[:, None]) + t[:, None] * beneath
    # three sums and products in single precision
    assert evaluated(coated, wi, wo, lam[:, None]) == pytest.approx(expected, rel=1e-5)


def test_over_a_white_base_no_light_is_gained_where_a_mirror_would_gain_none(variant):
    white = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}
    flat = md.HeightField(np.zeros((60, 60)), 0.08)
    bsdf = load(flat, int_ior=1.5, white=white)
    n = 1 << 14
    rng = np.random.default_rng(4)
    s1, s2 = mi.Float(rng.random(n).astype("f4")), mi.Point2f(*rng.random((2, n)).astype("f4"))
    for theta in (0.0, 50.0):
        si = interaction(np.tile(polar(theta), (n, 1)), 550.0)
        _, weight = bsdf.sample(mi.BSDFContext(), si, s1, s2)
        weights = spectra(weight)[:, 0]
        # three standard errors, and 2 % for the lobe of so small a window (kσ = 13)
        assert weights.mean() < 1.0 + 3 * weights.std() / np.sqrt(n) + 0.02


def test_flags_say_what_there_is(some_variant):
    bare = load(int_ior=1.5)
    assert bare.component_count() == 1
    assert mi.has_flag(bare.flags(), mi.BSDFFlags.GlossyReflection)
    assert mi.has_flag(bare.flags(), mi.BSDFFlags.Anisotropic)
    assert mi.has_flag(bare.flags(), mi.BSDFFlags.FrontSide)
    assert not mi.has_flag(bare.flags(), mi.BSDFFlags.BackSide)
    coated = load(int_ior=1.5, pigment={"type": "diffuse"})
    assert coated.component_count() == 2
    assert mi.has_flag(coated.flags(), mi.BSDFFlags.DiffuseReflection)
    assert mi.has_flag(coated.flags(1), mi.BSDFFlags.DiffuseReflection)


# ------------------------------------------------------------------------ parameters that change


def test_what_may_change_is_listed(some_variant):
    names = {
        "perfect": set(mi.traverse(load()).keys()),
        "dielectric": set(mi.traverse(load(int_ior=1.5)).keys()),
        "conductor": set(mi.traverse(load(material="Al")).keys()),
        "coated": set(mi.traverse(load(int_ior=1.5, pigment={"type": "diffuse"})).keys()),
    }
    always = {"height_scale", "orientation"}
    assert names["perfect"] == always
    assert names["dielectric"] == always | {"eta"}
    assert always < names["conductor"]
    assert {n.split(".")[0] for n in names["conductor"]} == always | {"eta", "k"}
    assert always | {"eta"} < names["coated"]
    assert any(n.startswith("nested.") for n in names["coated"])


def test_a_changed_height_scale_is_that_of_a_new_plugin(variant):
    bsdf = load()
    parameters = mi.traverse(bsdf)
    parameters["height_scale"] = 1.4
    parameters.update()
    wi, wo, lam = pairs()
    changed = brdf_values(bsdf, wi, wo, lam[:, None])
    assert changed == pytest.approx(
        brdf_values(load(height_scale=1.4), wi, wo, lam[:, None]),
        rel=1e-2,  # another table, since this one must serve 1.5 · 1.4; to 1e-3 of all
        abs=1e-3 * changed.max(),
    )
    expected = bsdf.table.brdf(wi, wo, lam, height_scale=1.4)
    assert np.sum(np.abs(changed - expected)) < 1e-5 * np.sum(expected)  # single precision


@pytest.mark.parametrize("scale", [1.51, 0.0, -1.0, float("nan")])
def test_a_height_scale_beyond_the_table_is_a_named_error(some_variant, scale):
    parameters = mi.traverse(load())
    parameters["height_scale"] = scale
    with pytest.raises((md.DiffractionError, RuntimeError)) as caught:
        parameters.update()
    *_, line = str(caught.value).splitlines()
    assert "is outside what the table serves, above 0 and up to 1.5; load the plugin anew" in line


def test_values_are_differentiable_in_the_scale_and_the_orientation(variant):
    wi, wo, lam = pairs(60)
    for name, at, step in (("height_scale", 0.9, 1e-2), ("orientation", 20.0, 5e-2)):
        values = {}
        for offset in (-step, 0.0, step):
            bsdf = load(tolerance=1e-4)
            parameters = mi.traverse(bsdf)
            parameters[name] = mi.Float(at + offset)
            if offset == 0.0:
                dr.enable_grad(parameters[name])
            parameters.update()
            value = bsdf.eval(mi.BSDFContext(), interaction(wi, lam[:, None]), vectors(wo))
            if offset == 0.0:
                dr.forward(parameters[name])
                derivative = spectra(dr.grad(value))
            values[offset] = spectra(value)
        differences = (values[step] - values[-step]) / (2 * step)
        # central differences: a hundredth of the change over which the values turn
        error = np.sum(np.abs(derivative - differences)) / np.sum(np.abs(differences))
        assert error < 2e-2, name


def test_a_new_value_needs_no_new_kernel(variant):
    bsdf = load()
    parameters = mi.traverse(bsdf)
    wi, wo, lam = pairs(20)
    si, outgoing, context = interaction(wi, lam[:, None]), vectors(wo), mi.BSDFContext()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for scale in (0.7, 0.8, 0.9):
            parameters["height_scale"] = scale
            parameters["orientation"] = 10 * scale
            parameters.update()
            dr.eval(bsdf.eval(context, si, outgoing))
            history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
            if scale > 0.7:
                assert all(kernel["cache_hit"] for kernel in history)


def test_it_says_what_it_is(some_variant):
    text = str(load(int_ior=1.5, orientation=30.0, height_scale=1.2))
    assert text.startswith("Diffraction[\n")
    for part in (
        "svd power, ensemble",
        "coherence_width = 4.5 µm",
        "tolerance = 0.001",
        "dielectric[eta = 1.4996]",
        "height_scale = 1.2",
        "orientation = 30°",
    ):
        assert part in text
    assert "SmoothDiffuse" in str(load(int_ior=1.5, pigment={"type": "diffuse"}))
    assert "conductor[Al]" in str(load(material="Al"))


# ------------------------------------------------------------------------ scenes and variants

XML = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0,-3,3" target="0,0,0" up="0,0,1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
  </sensor>
  <emitter type="constant"/>
  <shape type="rectangle">
    <bsdf type="twosided">
      <bsdf type="diffraction">
        <string name="heightfield" value="patch.npy"/>
        <string name="pixel_size" value="0.085, 0.08"/>
        <string name="max_height" value="auto"/>
        <float name="coherence_width" value="4.5"/>
        <string name="coherence" value="ensemble"/>
        <float name="tolerance" value="1e-3"/>
        <float name="orientation" value="15"/>
        <float name="int_ior" value="1.5"/>
        <boolean name="energy_conserving" value="false"/>
        <bsdf type="diffuse"><spectrum name="reflectance" value="0.2"/></bsdf>
      </bsdf>
    </bsdf>
  </shape>
</scene>
"""


def test_scenes_in_xml_render(variant, tmp_path, monkeypatch):
    np.save(tmp_path / "patch.npy", PATCH.heights)
    monkeypatch.chdir(tmp_path)
    scene = mi.load_string(XML)
    image = np.array(mi.render(scene, spp=16, seed=1))
    assert np.all(np.isfinite(image))
    # a sky of radiance 1 over 20 % pigment and a few per cent of reflection, in sRGB's luminance
    luminance = image[3:5, 3:5, :3].mean()
    assert 0.1 < luminance < 0.4


def test_a_dictionary_from_arrays(some_variant):
    given = md.bsdf_dict(PATCH, material="Al", coherence_width=WIDTH, energy_conserving=False)
    assert given["type"] == "diffraction"
    assert given["pixel_size"] == "0.085, 0.08"
    bsdf = mi.load_dict({"type": "sphere", "bsdf": given}).bsdf()
    assert bsdf.table.source["pixel_size"] == [0.085, 0.08]


def test_variants_may_be_switched_back_and_forth(some_variant):
    wi, wo, lam = pairs(20)
    first = load()
    before = evaluated(first, wi, wo, lam[:, None])
    for name in ("scalar_rgb", "llvm_ad_rgb", some_variant):
        mi.set_variant(name)
    assert np.array_equal(evaluated(load(), wi, wo, lam[:, None]), before)
    assert np.array_equal(evaluated(first, wi, wo, lam[:, None]), before)  # still of use


LOADS = """
import numpy as np
heights = 0.01 * np.sin(np.arange(64) / 64 * 2 * np.pi)[None, :] + np.zeros((64, 1))
def check():
    b = mi.load_dict(md.bsdf_dict(md.HeightField(heights, 0.08), coherence_width=5.0))
    assert 'Diffraction[' in str(b), b
"""


@pytest.mark.parametrize(
    "order",
    [
        "import mitsuba_diffraction as md, mitsuba as mi; mi.set_variant('{0}')",
        "import mitsuba as mi; mi.set_variant('{0}'); import mitsuba_diffraction as md",
        "import mitsuba as mi; import mitsuba_diffraction as md; mi.set_variant('scalar_rgb'); "
        "mi.set_variant('{0}'); mi.set_variant('llvm_ad_rgb'); mi.set_variant('{0}')",
    ],
    ids=["import first", "variant first", "several variants"],
)
def test_the_plugin_is_there_whenever_it_is_imported(some_variant, order):
    code = f"{order.format(some_variant)}\n{LOADS}\ncheck()"
    result = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:mitsuba_diffraction", "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (result.returncode, result.stderr) == (0, "")
