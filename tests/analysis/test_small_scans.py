"""Scans of a few pixels, of wide pixels, and of no relief are measured, or refused in one line."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.crops import crops_of
from mitsuba_diffraction.analysis.pictures import patches_figure
from mitsuba_diffraction.analysis.tradeoff import lit_pairs
from mitsuba_diffraction.heights import LoadOptions


def rough(shape, pixel_size):
    return HeightField(0.01 * np.random.default_rng(2).normal(size=shape), pixel_size)


@pytest.mark.parametrize(("shape", "pixel_size"), [((2, 2), 0.1), ((3, 200), 0.1), ((8, 8), 40.0)])
def test_a_small_scan_has_a_picture(shape, pixel_size):
    images = [image for axes in patches_figure([rough(shape, pixel_size)]).axes
              for image in axes.get_images()]  # fmt: skip
    assert len(images) == 3
    assert all(np.size(image.get_array()) for image in images)


@pytest.mark.parametrize("pixels", [2, 4, 5, 6, 9])
def test_all_light_of_a_flat_scan_is_unscattered(pixels):
    figure = patches_figure([HeightField(np.zeros((pixels, pixels)), 0.1)])
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert "unscattered: 100% at 450 nm, 100% at 550 nm, 100% at 650 nm" in texts


@pytest.mark.parametrize(("pixel_size", "pixels"), [(1.0, [10] * 4), (6.0, [2] * 4), (15.0, []),
                                                    (25.0, []), (0.09, [])])  # fmt: skip
def test_squares_are_cut_where_they_fit_and_have_more_than_a_pixel(pixel_size, pixels, tmp_path):
    np.save(tmp_path / "a.npy", rough((100, 100), 1.0).heights)
    options = LoadOptions.parse(pixel_size=pixel_size)
    crops = crops_of(tmp_path / "a.npy", options, 4, 10.0)
    assert [crop.shape for crop in crops] == [(n, n) for n in pixels]


@pytest.mark.parametrize("n", [40, 42])
def test_pairs_are_as_many_as_asked_for_where_most_orders_are_evanescent(n):
    pairs = lit_pairs(rough((256, 256), 0.005), 2.0, n, seed=0)
    assert len(pairs.wi) == len(pairs.wavelength) == n
    assert (pairs.wo[:, 2] > 0.0).all()
