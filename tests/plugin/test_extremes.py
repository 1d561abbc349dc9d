"""The plugin at the extremes of surfaces and angles: finite, not negative, and its table's twin."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from tests.support.directions import as_single, polar, rough_patch
from tests.support.gentle import load
from tests.support.lanes import evaluated

pytestmark = pytest.mark.thorough


def deep(depth: float, shape=(12, 12), pixels=(0.1, 0.1), offset: float = 0.0) -> HeightField:
    field = rough_patch(shape, pixels, depth)
    return HeightField(field.heights + offset, pixels)


CASES = {
    "1 nm": (deep(1e-3), 1.0, {}),
    "5 µm": (deep(5.0, (6, 6)), 1.0, {"tolerance": 1e-2}),
    "2 × 2 pixels": (deep(0.1, (2, 2)), 1.0, {}),
    "pixels of 1:10, 5 mm up": (deep(0.2, (8, 40), (0.05, 0.5), 5e3), 1.0, {}),
    "a window of a tenth, one spot": (deep(0.2, (32, 32)), 0.1, {"coherence": "patch"}),
    "a window of ten": (deep(0.2), 10.0, {}),
}


def extreme_pairs() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random directions, and grazing, mirroring and retro-reflecting ones; nm."""
    rng = np.random.default_rng(3)
    cosine = rng.random((2, 400))
    cosine[:, :100] = np.cos(np.radians(rng.uniform(89.0, 89.99, (2, 100))))
    phi = rng.uniform(0.0, 2.0 * np.pi, (2, 400))
    cosine[1, 100:300] = cosine[0, 100:300]
    phi[1, 100:200], phi[1, 200:300] = phi[0, 100:200] + np.pi, phi[0, 200:300]
    sine = np.sqrt(1.0 - cosine**2)
    wi, wo = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1)
    return as_single(wi), as_single(wo), as_single(rng.uniform(360.0, 830.0, 400))


@pytest.mark.parametrize("name", CASES)
def test_values_are_finite_and_those_of_the_table(variant, name):
    field, width, parameters = CASES[name]
    bsdf = mi.load_dict(
        md.bsdf_dict(
            field,
            coherence_width=width * min(field.extent),
            material="none",
            energy_conserving=False,
            **parameters,
        )
    )
    wi, wo, lam = extreme_pairs()
    found = evaluated(bsdf, wi, wo, lam[:, None])
    assert np.all(np.isfinite(found))
    assert np.all(found >= 0.0)
    expected = bsdf.table.brdf(wi, wo, lam) * wo[:, 2]
    # single precision of phases, as in tests/bsdf; the deepest series has functions of κ that turn
    # once in 2π/κH = 1/40 of the range of κ, known to 6e-8·κH = 2e-5 of a radian
    assert np.abs(found[:, 0] - expected).sum() < 2e-4 * expected.sum()


@pytest.mark.parametrize(
    "parameters", [{}, {"energy_conserving": True}, {"shadowing": "vcavity"}, {"int_ior": 1.5}]
)
@pytest.mark.parametrize("theta", [89.0, 89.99])
def test_reciprocity_near_the_horizon(some_variant, theta, parameters):
    bsdf = load(**parameters)
    rng = np.random.default_rng(0)
    wi = np.array([polar(t, p) for t, p in rng.uniform((0, 0), (60, 360), (100, 2))], "f4")
    wo = np.array([polar(theta, p) for p in rng.uniform(0, 360, 100)], "f4")
    there = evaluated(bsdf, wi, wo, 550.0) / wo[:, 2:]
    back = evaluated(bsdf, wo, wi, 550.0) / wi[:, 2:]
    # a dozen operations in single precision
    assert there == pytest.approx(back, rel=1e-6)


def test_a_density_below_single_precision_draws_nothing(monkeypatch):
    mi.set_variant("scalar_spectral")
    bsdf = mi.load_dict(md.bsdf_dict(deep(0.0), coherence_width=2.0))
    # double precision; as a number of a spectrum it is 0
    monkeypatch.setattr(type(bsdf), "evaluated", lambda *_: (mi.Spectrum(1.0), 1e-60))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.wavelengths = mi.Vector3f(polar(20)), mi.Spectrum(500.0)
    sample, weight = bsdf.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.4, 0.6))
    assert sample.pdf == 0.0
    assert not any(weight)
