"""BRDF maps: against the reference integral, mirrors, gratings, and flat BSDFs."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.maps import Bands, LightDirection, brdf_map, evaluate, hemisphere
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.optics.geometry import sigma_of
from tests.analysis.maps.mapped import GRATING, centres, mirror, plugin
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough


@pytest.mark.usefixtures("variant")
def test_a_map_is_the_reference_integrated_over_pixels_and_wavelengths():
    field, width = rough_patch((20, 24), (0.2, 0.2), 0.2), 4.0
    light, bands, n, samples = LightDirection(25.0, 60.0), Bands(360, 830, 47), 12, 3
    result = brdf_map(
        plugin(field, coherence_width=width, tolerance=1e-4), light.theta, light.phi,
        step=47, resolution=n, samples=samples,
    )  # fmt: skip
    expected = np.zeros((n, n, 3))
    y0, x0 = np.meshgrid(hemisphere.corners(n), hemisphere.corners(n), indexing="ij")
    for shift_x, shift_y, offset in hemisphere.sub_samples(samples):
        x, y = (x0 + shift_x * 2 / n).ravel(), (y0 + shift_y * 2 / n).ravel()
        z2 = 1 - x**2 - y**2
        wo = np.stack([x, y, np.sqrt(np.maximum(z2, 0))], axis=1)
        wo /= np.linalg.norm(wo, axis=1, keepdims=True)  # beyond the horizon on it: the BRDF is 0
        lam = bands.wavelengths(offset)
        for wavelength, weight in zip(lam, response(lam) * bands.width, strict=True):
            f = md.reference.brdf(field, light.direction, wo, wavelength, coherence_width=width)
            expected += (f[:, None] * weight / samples).reshape(n, n, 3)
    difference = np.abs(result.xyz - expected)
    # the table's tolerance is of this sum; taken over the map, it leaves room for its 1e-4
    assert difference.sum() / expected.sum() < 3e-4


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("illuminant", ["D65", "E"])
def test_a_mirror_is_white_as_a_whole(illuminant):
    result = brdf_map(mirror(), 40.0, 20.0, step=10, resolution=200, illuminant=illuminant)
    white = response(np.arange(360.0, 831.0), illuminant).sum(axis=0)
    # a mirror's lobe holds 1 within 1e-3 up to 60°, as the Kirchhoff factors vary across it
    np.testing.assert_allclose(result.albedo(), white, rtol=1e-3)


@pytest.mark.usefixtures("variant")
def test_a_mirror_s_lobe_lies_where_a_mirror_reflects_and_is_as_wide_as_the_window():
    n, light = 256, LightDirection(40.0, 30.0)
    result = brdf_map(mirror(), light.theta, light.phi, wavelength=550.0, resolution=n)
    x, total = centres(n), result.luminance.sum(dtype=float)
    along_x, along_y = (result.luminance.sum(axis=a, dtype=float) / total for a in (0, 1))
    centre = np.array([(x * along_x).sum(), (x * along_y).sum()])
    # the factors around the lobe's Gaussian move its centroid by a fraction of its width, 0.0054
    np.testing.assert_allclose(centre, light.mirror[:2], atol=5e-4)
    # exp(−σ²k²Δ²) has the standard deviation 1/√2σk; a pixel adds size²/12 to the variance
    expected = 1 / (2 * (sigma_of(65.0) * 2e3 * np.pi / 550) ** 2) + (2 / n) ** 2 / 12
    variance = (x**2 * along_x).sum() - centre[0] ** 2
    assert variance == pytest.approx(expected, rel=0.02)  # the same factors skew it a little


@pytest.mark.usefixtures("variant")
def test_any_bsdf_can_be_mapped_and_a_diffuse_one_is_flat_and_white():
    diffuse = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
    result = brdf_map(mi.load_dict(diffuse), 50.0, resolution=32)
    covered = result.coverage > 0
    # white is rounded to four digits in sRGB's matrix; the rest is single precision
    np.testing.assert_allclose(
        result.linear[covered] / result.coverage[covered, None], 0.5 / np.pi, rtol=5e-4
    )
    assert result.albedo()[1] == pytest.approx(0.5, rel=0.01)  # 4 samples find the rim's area
    assert np.all(result.xyz[~covered] == 0)


@pytest.mark.usefixtures("variant")
def test_with_the_cosine_a_diffuse_map_falls_towards_the_rim():
    diffuse = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
    result = brdf_map(mi.load_dict(diffuse), resolution=101, samples=1, cosine=True)
    x = centres(101)
    expected = 0.5 / np.pi * np.sqrt(np.maximum(1 - x**2, 0))
    np.testing.assert_allclose(result.luminance[50], expected, rtol=1e-4)  # single precision
    with pytest.raises(ValueError, match="no albedo"):
        result.albedo()


@pytest.mark.usefixtures("variant")
def test_bands_add_up_to_the_colours():
    bsdf = plugin(GRATING)
    # 10 bands: the last packet of wavelengths is not full
    result = brdf_map(bsdf, 10.0, step=47.0, resolution=64, samples=1, spectral=True)
    assert result.spectrum.shape == (10, 64, 64)
    weights = response(result.bands.wavelengths()) * result.bands.width
    expected = np.tensordot(result.spectrum, weights, axes=(0, 0))
    # sums of ten terms in single precision
    np.testing.assert_allclose(result.xyz, expected, rtol=1e-5, atol=1e-6 * expected.max())


@pytest.mark.usefixtures("variant")
def test_chunks_of_pixels_make_no_difference(monkeypatch):
    bsdf = plugin(GRATING)
    asked = {"theta": 20.0, "step": 100.0, "resolution": 32, "samples": 4, "spectral": True}
    steps = []
    whole = brdf_map(bsdf, **asked)
    monkeypatch.setattr(evaluate, "LAUNCH_PIXELS", 100)
    parts = brdf_map(bsdf, **asked, progress=lambda *s: steps.append(s[:2]))
    np.testing.assert_array_equal(whole.xyz, parts.xyz)
    np.testing.assert_array_equal(whole.spectrum, parts.spectrum)
    assert [done for done, _ in steps] == list(range(steps[-1][1] + 1))


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("theta", [0.0, 13.0, 31.0])
def test_a_lobe_narrower_than_a_pixel_is_not_missed(theta):
    # standard deviation of the lobe 1/√2σk = 0.0038, an eighth of a pixel
    result = brdf_map(mirror(), theta, wavelength=550.0, resolution=64)
    assert result.samples == 34  # √2 standard deviations apart
    assert result.albedo() == pytest.approx(1.0, abs=1e-3)  # a mirror's is 1 within that


@pytest.mark.usefixtures("variant")
def test_dispersed_orders_have_no_beads():
    bsdf = plugin(md.gratings.sinusoidal(period=10.0, depth=1.0, periods=1), coherence_width=130.0)
    n, asked = 256, {"wavelength_range": (500.0, 600.0), "samples": 16}
    coarse, fine = (brdf_map(bsdf, step=s, resolution=n, **asked).luminance for s in (5.0, 2.0))
    # order 8 moves by two lobe widths every 5 nm: single wavelengths would stand apart
    x = centres(n)
    order = (x > 8 * 0.52 / 10) & (x < 8 * 0.58 / 10)
    lines = [m.sum(axis=0, dtype=float)[order] for m in (coarse, fine)]
    np.testing.assert_allclose(lines[0], lines[1], rtol=0.05)


def test_an_rgb_variant_maps_the_colours_of_the_whole_spectrum(some_variant):
    field, width = rough_patch((20, 24), (0.2, 0.2), 0.2), 4.0
    asked = {"theta": 25.0, "phi": 60.0, "resolution": 16, "samples": 3}
    spectral = brdf_map(plugin(field, coherence_width=width), step=2.0, **asked)
    mi.set_variant(some_variant.replace("spectral", "rgb"))
    found = brdf_map(plugin(field, coherence_width=width), **asked)
    mi.set_variant(some_variant)
    assert found.xyz.shape == spectral.xyz.shape
    # what the colour table is built for (tables.colour_table): under 1 ΔE of brightest colours
    assert np.abs(found.xyz - spectral.xyz).sum() < 0.01 * spectral.xyz.sum()
