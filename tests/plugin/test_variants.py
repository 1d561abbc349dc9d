"""Every variant of Mitsuba that this machine runs: the same light, in its own numbers."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.optics.colour import delta_e, linear_srgb, response
from mitsuba_diffraction.plugin import materials
from mitsuba_diffraction.tables.colour.table import ColourTable
from tests.support.directions import Array, as_single, rough_patch, uniform_directions
from tests.support.variants import ALL, evaluate, interaction, runs

pytestmark = pytest.mark.thorough

WIDTH = 8.0  # µm
HEIGHTS = rough_patch((90, 100), (0.085, 0.09), 0.2, 0.9)
N = 24


def load(**parameters: Any) -> Any:
    raw = {"energy_conserving": False, "coherence_width": WIDTH}
    return mi.load_dict(md.bsdf_dict(HEIGHTS, **(raw | parameters)))


def pairs(seed: int = 3) -> tuple[Array, Array, Array]:
    """Incident and outgoing directions (N, 3), half of them near the mirror, and samples (N, 3)."""
    rng = np.random.default_rng(seed)
    wi, wo = uniform_directions(N, rng, 0.3), uniform_directions(N, rng, 0.3)
    near = slice(0, N // 2)
    wo[near, :2] = -wi[near, :2] + rng.normal(0.0, 0.03, (N // 2, 2))
    wo[near, 2] = np.sqrt(np.maximum(1.0 - (wo[near, :2] ** 2).sum(axis=1), 0.01))
    return wi, as_single(wo / np.linalg.norm(wo, axis=1)[:, None]), rng.random((N, 3))


def expected(wi: Array, wo: Array, wavelengths: Array) -> Array:
    """f·cosθo (N, channels) in the current variant's numbers, without Mitsuba."""
    table = DiffractionTable.build(HEIGHTS, coherence_width=WIDTH)
    if mi.is_rgb:
        u, v, w = (wi + wo).T
        colours = ColourTable.build(table).colour(u, v, w)
        outside = ((1.0 + (wi * wo).sum(axis=1)) / w) ** 2 / wi[:, 2]
        return 4.0 * np.pi * table.sigma**2 * outside[:, None] * colours
    columns = [table.brdf(wi, wo, lam) * wo[:, 2] for lam in wavelengths.T]
    return np.stack(columns if mi.is_spectral else columns[:1], axis=1)


def wavelengths() -> Array:
    if not mi.is_spectral:
        return np.full((N, 4), 600.0)
    return as_single(np.random.default_rng(4).uniform(400.0, 700.0, (N, 4)))


@pytest.mark.parametrize("name", ALL)
def test_values_are_those_of_the_table(name: str) -> None:
    if not runs(name):
        pytest.skip(f"{name}: Dr.Jit finds no device for it")
    mi.set_variant(name)
    wi, wo, samples = pairs()
    lam = wavelengths()
    value = evaluate(load(material="none", wavelength=600.0), wi, wo, samples, lam)[0]
    truth = expected(wi, wo, lam)
    if mi.is_rgb:  # colours of a table lack the lobe of order 0 as the horizon sees it
        far = np.hypot(*(wi + wo)[:, :2].T) > 0.15
        value, truth = value[far], truth[far]
    # single precision: a phase of some hundred radians across the window has an error of 1e-4
    assert value == pytest.approx(truth, rel=2e-3, abs=2e-5 * np.abs(truth).max())


def check_agreement(bsdf: Any, component: int | None = None) -> Array:
    """`eval`, `pdf`, `eval_pdf` and `sample` of a context's component; returns the values."""
    wi, wo, samples = pairs()
    lam = wavelengths()
    value, pdf, again, pdf_again, drawn, drawn_pdf, weight = evaluate(
        bsdf, wi, wo, samples, lam, component
    )
    assert again == pytest.approx(value, rel=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-5)
    assert np.all(pdf > 0.0)
    valid = drawn_pdf > 0.0
    assert valid.sum() > N // 2
    wi, drawn, samples, lam = wi[valid], drawn[valid], samples[valid], lam[valid]
    there, pdf, *_ = evaluate(bsdf, wi, drawn, samples, lam, component)
    assert drawn_pdf[valid] == pytest.approx(pdf, rel=1e-3)
    assert weight[valid] * pdf[:, None] == pytest.approx(
        there, rel=2e-3, abs=1e-5 * np.abs(there).max()
    )
    return value


def test_components_add_up_and_are_drawn_as_they_are_evaluated(every_variant: str) -> None:
    grey = {"type": "diffuse", "reflectance": 0.5}
    bsdf = load(wavelength=600.0, nested=grey)
    both, above, beneath = (check_agreement(bsdf, component) for component in (None, 0, 1))
    assert above + beneath == pytest.approx(both, rel=1e-5)
    assert above == pytest.approx(check_agreement(load(wavelength=600.0)), rel=1e-5)


def test_a_picture_of_directions_turns_as_degrees_do(every_variant: str) -> None:
    angle = np.deg2rad(25.0)
    picture = np.broadcast_to([np.cos(angle), np.sin(angle), 0.0], (2, 2, 3)).astype(np.float32)
    texture = {"type": "bitmap", "raw": True, "data": mi.TensorXf(picture)}
    wi, wo, samples = pairs()
    turned, expected = (
        evaluate(load(wavelength=600.0, orientation=by), wi, wo, samples, wavelengths())[0]
        for by in (texture, 25.0)
    )
    # the angle's sine in single precision, times kσ = 20
    assert turned == pytest.approx(expected, rel=1e-4, abs=1e-5 * expected.max())


def test_a_wavelength_outside_the_table_is_refused(every_variant: str) -> None:
    with pytest.raises(RuntimeError, match="wavelength=900 nm is outside the table's 360 to 830"):
        load(wavelength=900.0)


LINE = 600.0  # nm


def picture(spp: int, bsdf: dict[str, Any] | None = None, response: Any = None) -> Array:
    """A plate under one lamp, (8, 8, 3): diffracting, or of another BSDF.

    response : spectral response of the sensor, a plugin.
    """
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "perspective",
            "fov": 30,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=[0.6, 0, 3], target=[0, 0, 0], up=[0, 1, 0]
            ),
            "film": {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "rgb"},
        },
        "lamp": {
            "type": "directional",
            "direction": [-0.15, 0.35, -0.9],
            "irradiance": {"type": "rgb", "value": 1.0},
        },
        "plate": {"type": "rectangle", "bsdf": bsdf or diffracting()},
    }
    if response is not None:
        scene["sensor"]["srf"] = response
    image = np.array(mi.render(mi.load_dict(scene), spp=spp), float)
    return np.broadcast_to(image, (8, 8, 3))


def diffracting() -> dict[str, Any]:
    return md.bsdf_dict(HEIGHTS, coherence_width=WIDTH, material="none", wavelength=LINE)


def spectral_variant() -> str:
    return "llvm_ad_spectral" if runs("llvm_ad_spectral") else "scalar_spectral"


@pytest.fixture(scope="module")
def spectral_picture() -> Array:
    mi.set_variant(spectral_variant())
    return picture(2048)


@pytest.fixture(scope="module")
def line_picture() -> Array:
    """In the light of one wavelength alone, relative to a white plate, (8, 8)."""
    mi.set_variant(spectral_variant())
    line = {"type": "regular", "wavelength_min": LINE - 0.5, "wavelength_max": LINE + 0.5}
    line["values"] = "1, 1"
    return picture(2048, response=line)[..., 0] / picture(16, WHITE, line)[..., 0]


WHITE = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}


def test_a_small_scene_has_the_colours_of_the_spectral_one(
    request: pytest.FixtureRequest, every_variant: str
) -> None:
    scalar, mono = every_variant.startswith("scalar"), "mono" in every_variant
    truth = request.getfixturevalue("line_picture" if mono else "spectral_picture")
    mi.set_variant(every_variant)
    found = picture(32 if scalar else 1024)
    if mono:
        found = found[..., 0] / picture(16, WHITE)[..., 0]
    assert np.all(np.isfinite(found))
    # twice the noise: four random wavelengths a ray, and lobes smaller than pixels
    tolerance = 0.2 if scalar else 0.04
    assert found.mean(axis=(0, 1)) == pytest.approx(
        truth.mean(axis=(0, 1)), rel=tolerance, abs=tolerance * truth.mean()
    )


def test_gold_has_the_colour_of_its_spectrum(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearer than with one reflectance a channel, which lines of light do not all share."""
    wi, wo, _ = pairs()
    lines = np.arange(362.5, 780.0, 5.0, np.float32).reshape(-1, 4)
    mi.set_variant(spectral_variant())
    bsdf, truth = load(material="Au"), np.zeros((N, 3))
    for group in lines if dr.is_jit_v(mi.Float) else []:
        si = interaction(wi, np.tile(group, (N, 1)))
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))).T
        truth += 5.0 * value @ linear_srgb(response(group))
    if not truth.any():
        pytest.skip("scalar variants would take minutes")
    mi.set_variant(mi.variant().replace("spectral", "rgb"))
    errors = []
    for tinted in (True, False):
        with monkeypatch.context() as patch:
            if not tinted:
                patch.setattr(materials, "metal_tint", lambda *_: np.eye(3))
            si = interaction(wi, lines)
            found = np.array(load(material="Au").eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))).T
        errors.append(delta_e(truth, found, least=1e-3))
    assert np.nanmean(errors[0]) < 0.7 * np.nanmean(errors[1])


@pytest.mark.parametrize("theta", [0.0, 50.0])
def test_rgb_samples_integrate_what_the_density_says(theta: float) -> None:
    if not runs("llvm_ad_rgb"):
        pytest.skip("llvm_ad_rgb: Dr.Jit finds no device for it")
    mi.set_variant("llvm_ad_rgb")
    bsdf, count = load(material="none"), 1 << 17
    angle = np.radians(theta)
    si = interaction(np.tile([np.sin(angle), 0.0, np.cos(angle)], (count, 1)), np.zeros(0))
    rng = mi.PCG32(count)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    sample, weight = bsdf.sample(mi.BSDFContext(), si, one, two)
    uniform = mi.warp.square_to_uniform_hemisphere(two)
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, uniform)
    dr.eval(sample, weight, value, pdf)  # one kernel instead of five
    pdf, value = np.array(pdf) * 2.0 * np.pi, np.array(value).T * 2.0 * np.pi
    drawn, weight = np.array(sample.wo).T, np.array(weight).T
    valid = np.array(sample.pdf) > 0.0

    def agree(a: Array, b: Array) -> None:
        error = np.hypot(a.std(axis=0), b.std(axis=0)) / np.sqrt(count)
        assert np.all(np.abs(a.mean(axis=0) - b.mean(axis=0)) < 4.0 * error)  # 1 in 16 000 each

    # in quarters of the hemisphere: how many samples fall there, and what light they find
    for quarter in range(4):
        side = np.arctan2(drawn[:, 1], drawn[:, 0]) // (np.pi / 2) + 2 == quarter
        of_uniform = np.array(uniform).T
        mine = np.arctan2(of_uniform[:, 1], of_uniform[:, 0]) // (np.pi / 2) + 2 == quarter
        agree((side & valid).astype(float), pdf * mine)
        agree(weight * side[:, None], value * mine[:, None])


def lit_from(direction: Array) -> Array:
    """Mean colour of a plate, seen from above in light from one direction: nothing is random."""
    above = mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0])
    scene = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "light": {"type": "directional", "direction": (-direction).tolist()},
        "plate": {"type": "rectangle", "bsdf": diffracting()},
        "sensor": {
            "type": "orthographic",
            "to_world": above @ mi.ScalarTransform4f().scale([0.5, 0.5, 1.0]),
            "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
        },
    }
    return np.array(mi.render(mi.load_dict(scene), spp=4), float)[..., :3].mean(axis=(0, 1))


def test_scalar_variants_keep_colours_below_zero() -> None:
    if not runs("llvm_ad_rgb"):
        pytest.skip("llvm_ad_rgb: Dr.Jit finds no device for it")
    mi.set_variant("llvm_ad_rgb")
    bsdf, rng = load(material="none"), np.random.default_rng(1)
    directions = uniform_directions(400, rng, 0.3)
    si = interaction(np.tile([0.0, 0.0, 1.0], (400, 1)), np.zeros(0))
    values = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(directions.T))).T
    most = directions[np.argmin(values.min(axis=1) / values.max(axis=1))]
    expected = lit_from(most)
    assert expected.min() < -0.01 * expected.max()
    mi.set_variant("scalar_rgb")
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)  # it warns of each sample below zero, and takes it
    try:
        assert lit_from(most) == pytest.approx(expected, rel=1e-4, abs=1e-5 * expected.max())
    finally:
        mi.set_log_level(level)
