"""The blend of small slope and Kirchhoff: what it weighs by, and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.blend import NODES_PER_OCTAVE, ScaleRoughness
from mitsuba_diffraction.reference import model
from tests.support.directions import polar, rough_patch

PATCH = rough_patch((40, 56), (0.11, 0.09), 0.3)


def roughness() -> ScaleRoughness:
    return ScaleRoughness.from_heights(PATCH.heights, PATCH.pixel_size)


def test_it_is_the_sum_over_all_components():
    power = np.abs(np.fft.fft2(PATCH.heights) / PATCH.heights.size) ** 2
    ny, nx = PATCH.shape
    qx = 2 * np.pi * np.fft.fftfreq(nx, PATCH.pixel_size[0])
    qy = 2 * np.pi * np.fft.fftfreq(ny, PATCH.pixel_size[1])[:, None]
    power[0, 0] = 0
    for q in (0.3, 2.0, 7.0, 30.0):
        ratio = np.hypot(qx, qy) / q
        share = (1 - np.exp(-((4 * ratio) ** 4))) * np.exp(-((ratio / 2) ** 4))
        # components are told apart to 1/256 of an octave
        assert roughness().at(q) == pytest.approx((power * share).sum(), rel=1e-5)
    assert roughness().at(0.0) == 0.0


def test_a_table_of_nodes_interpolates_to_it():
    exact = roughness()
    table = exact.table(35.0)
    q = np.geomspace(0.01, 35.0, 2000)
    assert table.first + (len(table.nodes) - 1) / NODES_PER_OCTAVE >= np.log2(35.0)
    assert table.at(q) == pytest.approx(exact.at(q), abs=5e-4 * table.nodes.max())
    assert table.at(0.0) < 1e-30


def test_several_patches_have_the_mean_of_their_roughness():
    other = ScaleRoughness.from_heights(2 * PATCH.heights[:, ::-1], PATCH.pixel_size)
    q = np.geomspace(0.1, 35, 20)
    both = ScaleRoughness.mean([roughness(), other])
    assert both.at(q) == pytest.approx(2.5 * roughness().at(q), rel=1e-9)
    assert np.all(np.diff(both.frequency) >= 0)


def test_a_flat_surface_has_no_roughness_at_any_scale():
    flat = ScaleRoughness.from_heights(np.full((4, 6), 0.3), (0.1, 0.1))
    assert np.all(flat.at([0.0, 1.0, 30.0]) < 1e-30)
    table = flat.table(35.0)
    assert np.isfinite(table.first)
    assert np.all(table.nodes < 1e-30)


@pytest.mark.parametrize("index", [1.56, 0.65 + 5.6j])
def test_smooth_surfaces_follow_small_slope_and_rough_ones_kirchhoff(index):
    wi, wo = polar(60, 0), polar(20, 100)
    gentle, tangent = model.small_slope(wi, wo, index), model.kirchhoff(wi, wo, index)
    smooth = (model.small_slope_weight(20.0, rms**2, index) for rms in (0.0, 0.001))
    assert np.array_equal(model.blended(wi, wo, index, next(smooth)), gentle)
    assert model.blended(wi, wo, index, next(smooth)) == pytest.approx(gentle, abs=1e-3)
    rough = model.blended(wi, wo, index, model.small_slope_weight(20.0, 1.0, index))
    assert np.array_equal(rough, tangent)
