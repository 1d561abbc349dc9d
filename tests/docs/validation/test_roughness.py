"""Random surfaces against their closed forms, and `patch` at random places against `ensemble`."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import statistics
from docs.make.validation.cases import in_plane
from docs.make.validation.roughness import Roughness, mean_brdf

pytestmark = pytest.mark.thorough

#: Standard errors: a Gaussian's mean lies beyond once in 16000, and the seeds are fixed.
DISTANCE = 4.0


def test_heights_have_the_spread_slope_and_correlation_asked_for():
    rough = Roughness(0.05, 0.8)
    patches = [rough.patch(20.0, 128, seed) for seed in range(40)]
    rms = np.sqrt(np.mean([np.mean(p.heights**2) for p in patches]))
    # 40 patches of 20²/(π·0.8²/2) = 400 independent grains: 1/√(2·16000) = 0.6 %
    assert rms == pytest.approx(0.05, rel=0.025)
    slope = np.sqrt(np.mean([p.rms_slope**2 for p in patches]))
    # differences over 0.16 µm of a correlation of 0.8 µm: 1 % too small
    assert slope == pytest.approx(rough.rms_slope, rel=0.035)
    lag = 5  # pixels, 0.78 µm
    product = np.mean([np.mean(p.heights * np.roll(p.heights, lag, 1)) for p in patches])
    expected = np.exp(-((lag * 20 / 128 / 0.8) ** 2))
    assert product / rms**2 == pytest.approx(expected, abs=0.025)  # as the spread


def test_specular_loss_of_seeded_surfaces():
    found = statistics.specular(150, extent=20.0, pixels=64)
    assert np.abs(found.distance).max() < DISTANCE
    # it tells exp(−g) from a few per cent more roughness
    assert found.error[3] < 0.02 * found.mean[3]


@pytest.mark.parametrize("rms", [0.02, 0.05, 0.1])
def test_scattered_lobes_follow_beckmann_and_spizzichino(rms):
    found = statistics.lobe(rms, 60)
    assert np.abs(found.distance).max() < DISTANCE
    assert np.all(found.error < 0.2 * found.exact)


def test_the_mean_of_patches_at_random_places_is_the_ensemble():
    found = statistics.random_windows(300)
    assert np.abs(found.distance).max() < DISTANCE
    assert np.all(found.error < 0.09 * found.exact)


def test_deep_roughness_ends_in_geometrical_optics():
    # g = (κ·rms)² = 500: no coherent light, each direction sees the facets that mirror to it
    rough = Roughness(np.sqrt(500) / (2 * 2e3 * np.pi / 550), 10.0)
    wo = in_plane([0.0, 0.2])
    found = mean_brdf(rough, in_plane(0.0), wo, 550.0, coherence_width=100.0)
    u, cosine = wo[:, 0], wo[:, 2]
    w, slope2 = 1 + cosine, rough.rms_slope**2
    density = np.exp(-((u / w) ** 2) / slope2) / (np.pi * slope2)  # of slopes
    # the series nears it as 1/g, and the window widens the lobe by less
    assert found == pytest.approx(density / (cosine * w**2), rel=0.01)
