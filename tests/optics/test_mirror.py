"""A mirror's lobe: flat mirrors reflect as Fresnel says, and the horizon cuts it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mitsuba_diffraction.optics.boundary import geometry, power
from mitsuba_diffraction.optics.fresnel import reflectance
from mitsuba_diffraction.optics.lobes import nodes_across
from mitsuba_diffraction.optics.mirror import horizon_correction, mirror, mirror_cosine

#: 2π/λ of 550 nm, rad/µm.
WAVENUMBER = 2e3 * np.pi / 550.0
#: Widths of windows in µm at 550 nm, as kσ₀.
SHARPNESS = [2e3 * np.pi / 550.0 * width / 4.0 for width in (6.4, 12.0, 65.0)]
INDICES = {"perfect": None, "Al": 0.96 + 6.69j, "Au": 0.43 + 2.4j, "own": 2.2 + 1.5j}
INDICES |= {"glass": 1.5, "water": 1.33, "diamond": 2.42}


def albedo(sharp: float, degrees: float, index: complex | None) -> float:
    """∫ f₀ cosθo dωo of a flat mirror under a window of this kσ₀, by quadrature over the lobe."""
    theta, nodes, reach = np.radians(degrees), 200, 5.0 / sharp
    sine = np.sin(theta)
    first = np.sqrt(1.0 - min(sine + reach, 1.0) ** 2)
    last = np.sqrt(1.0 - max(sine - reach, 0.0) ** 2)
    places = (np.arange(nodes) + 0.5) / nodes
    half = min(np.pi, 1.2 * reach / max(sine, 1e-3))
    cos_o, turn = np.meshgrid(first + (last - first) * places, half * (2.0 * places - 1.0))
    sin_o = np.sqrt(1.0 - cos_o**2)
    apart = sin_o**2 + sine**2 - 2.0 * sin_o * sine * np.cos(turn)
    lobe = sharp**2 / np.pi * np.exp(-(sharp**2) * apart) * cos_o
    cos_i, sigma_0 = np.full_like(cos_o, np.cos(theta)), np.float64(sharp / WAVENUMBER)
    if index is not None:
        dot = cos_i * cos_o - sine * sin_o * np.cos(turn)
        cosine = mirror_cosine(np.sqrt(0.5 * (1.0 + dot)), cos_i, cos_o, np.float64(sharp))
        lobe *= reflectance(cosine, np.asarray(index))
    lobe *= horizon_correction(sigma_0 * cos_i**2, sigma_0 * cos_o**2, WAVENUMBER)
    return float(lobe.sum() * (last - first) * 2.0 * half / nodes**2)


@pytest.mark.parametrize("name", INDICES)
@pytest.mark.parametrize("sharp", SHARPNESS)
def test_a_flat_mirror_reflects_what_fresnel_says(name, sharp):
    index = INDICES[name]
    for degrees in (0.0, 30.0, 60.0, 70.0, 80.0, 85.0, 88.0):
        flat = 1.0 if index is None else float(reflectance(np.cos(np.radians(degrees)), index))
        ratio = albedo(sharp, degrees, index) / flat
        # the fit of h: no h is right for all shapes of R within a lobe
        assert 1.0 - (0.10 if degrees > 85.0 else 0.03) < ratio < 1.012
        assert ratio * flat < 1.004  # never more than is received, but for C of a straight horizon


@pytest.mark.parametrize(
    ("nm", "index", "most"), [(650.0, 1.47 + 7.79j, 1.022), (800.0, 2.8 + 8.45j, 1.056)]
)
def test_a_lobe_reflects_the_mean_about_aluminium_s_minimum(nm, index, most):
    # its least R is at 84 to 86°, where a lobe of 6.4 µm is several degrees wide (docs/theory.md)
    sharp = 2e3 * np.pi / nm * 6.4 / 4.0
    for degrees in (80.0, 84.0, 85.0, 88.0):
        flat = float(reflectance(np.cos(np.radians(degrees)), index))
        assert 0.98 < albedo(sharp, degrees, index) / flat < most


def test_the_lobe_is_reciprocal_and_that_of_fresnel_in_the_mirror_direction():
    wi, wo = (0.3, -0.2, np.sqrt(0.87)), (-0.1, 0.5, np.sqrt(0.74))
    index = 0.2 + 3.1j
    pairs = geometry(wi, wo), geometry(wo, wi)
    there, back = (power(mirror(pair, pair.cos_half, index)) for pair in pairs)
    assert there == pytest.approx(back, rel=1e-12)
    mirrored = (-wi[0], -wi[1], wi[2])
    pair = geometry(wi, mirrored)
    flat = power(mirror(pair, pair.cos_half, index))
    assert flat == pytest.approx(float(reflectance(np.float64(wi[2]), index)), rel=1e-12)


def test_means_over_a_cut_lobe_are_those_of_its_gaussian():
    width, radius = 0.06, np.array([0.7, 0.92, 0.98, 1.0, 1.05])
    sine = 1.0 - (np.arange(20000) + 0.5) / 20000 * 0.6
    lobe = np.exp(-(((sine - radius[:, None]) / width) ** 2)) * (0.6 / 20000)
    visible, cosine = lobe.sum(axis=1), np.sqrt(1.0 - sine**2)
    which, at, share = nodes_across(width, radius, 1e-6)
    found, means, poles = (np.bincount(which, share * at**power) for power in (0, 1, -1))
    # five nodes, and a lobe that is not cut is its middle
    assert_allclose(found, visible / (np.sqrt(np.pi) * width), atol=3e-3)
    assert_allclose(means / found, lobe @ cosine / visible, atol=3e-3)
    assert_allclose((poles / found)[1:], (lobe @ (1.0 / cosine) / visible)[1:], rtol=0.02)
