"""`coherence="surface"`: the window where the light falls, against the reference and its mean."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import kirchhoff_factor, sigma_of
from tests.support.directions import lit_pairs, uniform_directions
from tests.support.gentle import PATCH, WIDTH, hits, load
from tests.support.lanes import interaction, spectra, vectors

pytestmark = pytest.mark.thorough

ON_SURFACE = {"coherence": "surface", "uv_scale": 10.0}


def values_at(bsdf, wi, wo, lam, uv, v_axis=1.0):
    """f of one wavelength a pair (n,), at UV coordinates (n, 2), where v runs along ±t."""
    si = interaction(wi, lam[:, None])
    si.uv = mi.Point2f(*(np.ascontiguousarray(c, np.float32) for c in np.transpose(uv)))
    si.dp_du, si.dp_dv = mi.Vector3f(0.01, 0, 0), mi.Vector3f(0, 0.01 * v_axis, 0)
    found = spectra(bsdf.eval(mi.BSDFContext(), si, vectors(wo)))
    return found[np.arange(len(lam)), np.arange(len(lam)) % 4] / wo[:, 2]


def places(n, seed=0):
    """UV coordinates, exact in single precision."""
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (n, 2)).astype(np.float32).astype(float)


def relative(found, exact, light, near):
    """Σ|f − exact| / Σ exact of ⟨|P|²⟩ near order 0 and elsewhere, as the tolerance has it."""
    factor = kirchhoff_factor(*light, sigma_of(WIDTH))
    difference, size = np.abs(found - exact) / factor, exact / factor
    return [difference[m].sum() / size[m].sum() for m in (near, ~near)]


@pytest.mark.parametrize("taps", [None, 12])
def test_places_follow_scale_orientation_and_the_side_that_v_runs_to(variant, taps, tmp_path):
    wi, wo, lam, near = lit_pairs(PATCH, sigma_of(WIDTH), 200, 3)
    table = md.DiffractionTable.build(PATCH, coherence_width=WIDTH, coherence="patch", taps=taps)
    table.save(tmp_path / "patch.exr")
    turned = {"orientation": 90.0, "coherence": "surface", "uv_scale": "10, 20"}
    bsdf = mi.load_dict(
        {"type": "diffraction", "filename": str(tmp_path / "patch.exr"), "material": "none",
         "energy_conserving": False, **turned}
    )  # fmt: skip
    uv = places(200)
    # at 90° the patch's x is t, which v runs against, and its y is −s
    place = np.stack([-20.0 * uv[:, 1], -10.0 * uv[:, 0]], axis=1)
    to_patch = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    frame = (wi @ to_patch, wo @ to_patch, lam)
    exact = md.reference.brdf(
        PATCH, *frame, coherence_width=WIDTH, coherence="surface", place=place
    )
    found = values_at(bsdf, wi, wo, lam, uv, v_axis=-1.0)
    assert max(relative(found, exact, frame, near)) < 1e-3


def test_positions_in_the_world_are_those_of_uv_where_these_are_even(variant):
    wi, wo, lam, _ = lit_pairs(PATCH, sigma_of(WIDTH), 100, 3)
    uv = places(100)
    by_uv = values_at(load(**ON_SURFACE), wi, wo, lam, uv)
    world = load(coherence="surface", world_scale=1000.0)  # dp_du is 0.01
    # single precision: 1e-6 of 30 µm are 1e-4 rad between orders of a window
    assert values_at(world, wi, wo, lam, uv) == pytest.approx(
        by_uv, rel=1e-2, abs=1e-4 * by_uv.max()
    )


def grain():
    """Gaussian noise, 16 µm wide, whose speckle away from the mirror direction is Gaussian too."""
    noise = np.fft.fft2(np.random.default_rng(4).normal(size=(128, 128)))
    q = 2 * np.pi * np.fft.fftfreq(128, 0.125)
    smooth = np.exp(-0.25 * 0.3**2 * (q[:, None] ** 2 + q**2))
    heights = np.fft.ifft2(noise * smooth).real
    return md.HeightField(heights * (0.02 / heights.std()), 0.125)


@pytest.mark.parametrize("tiling", ["periodic", "random"])
def test_the_mean_is_the_ensemble_s_and_the_contrast_that_of_independent_windows(variant, tiling):
    given = {"coherence_width": 3.0, "tolerance": 3e-3}
    directions, each = 300, 256
    rng = np.random.default_rng(5)
    wi, wo = uniform_directions(directions, rng, 0.5), uniform_directions(directions, rng, 0.5)
    off = np.hypot(*(wi + wo)[:, :2].T) > 0.6  # of the mirror direction, by 9 of the lobe's widths
    wi, wo = wi[off], wo[off]
    lam = rng.uniform(400.0, 700.0, len(wi))
    mean = values_at(load(grain(), **given), wi, wo, lam, np.zeros((len(wi), 2)))
    many = (np.repeat(part, each, axis=0) for part in (wi, wo, lam))
    uv = rng.uniform(0.0, 1600.0, (len(wi) * each, 2))  # 1000 × 1000 patches
    found = values_at(load(grain(), **given, **ON_SURFACE, tiling=tiling), *many, uv)
    relative = found.reshape(-1, each) / mean[:, None]
    # 70 000 places, of a deviation of 1 each: a standard error of 0.004
    assert relative.mean() == pytest.approx(1.0, abs=0.01)
    for n in (1, 4, 16):
        contrast = relative.reshape(len(wi), -1, n).mean(axis=2).std()
        assert contrast == pytest.approx(1 / np.sqrt(n), rel=0.05)


def test_random_tiles_do_not_repeat_and_periodic_ones_do(mono):
    wi, wo, _, _ = lit_pairs(PATCH, sigma_of(WIDTH), 100, 3)
    here, again = hits(wi, places(100)), hits(wi, places(100) + np.array(PATCH.extent) / 10.0)
    for tiling, alike in (("periodic", True), ("random", False)):
        bsdf = load(**ON_SURFACE, tiling=tiling)
        one, other = (
            np.array(bsdf.eval(mi.BSDFContext(), si, vectors(wo))[0]) for si in (here, again)
        )
        assert np.allclose(one, other, rtol=1e-2, atol=1e-4 * one.max()) == alike


def test_directions_and_albedo_are_those_of_the_mean(mono):
    wi, wo, _, _ = lit_pairs(PATCH, sigma_of(WIDTH), 100, 3)
    given = {"int_ior": 1.5, "pigment": {"type": "diffuse"}}
    both = [load(**one | given) for one in (ON_SURFACE, {})]
    si, context = hits(wi, places(100)), mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, 0)
    one, other = (np.array(bsdf.pdf(context, si, vectors(wo))) for bsdf in both)
    # two tables of the same orders, each to its tolerance; cells have 8 bits
    assert one == pytest.approx(other, rel=0.02, abs=1e-3 * float(other.max()))
    one, other = (bsdf.describe().albedo_excess(1.0).values for bsdf in both)
    assert one == pytest.approx(other, rel=2e-3, abs=1e-4)
