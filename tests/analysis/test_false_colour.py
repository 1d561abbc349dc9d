"""Pictures in false colour: which receptor is which colour, and what adaptation keeps."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.analysis.false_colour import (
    adapted,
    false_colour_figure,
    shown_receptors,
)
from mitsuba_diffraction.analysis.observers import eye_of, responses


def test_four_receptors_have_two_pictures_and_two_are_yellow_and_blue():
    assert shown_receptors(4) == [(3, 2, 1), (2, 1, 0)]
    assert shown_receptors(3) == [(2, 1, 0)]
    assert shown_receptors(2) == [(1, 1, 0)]


def test_a_receptor_adapts_to_the_light_and_without_light_stays_dark():
    catches = np.random.default_rng(0).uniform(0.1, 1.0, (3, 4, 3))
    dimmed = catches * [1.0, 0.02, 0.0]
    assert adapted(dimmed)[..., :2] == pytest.approx(adapted(catches)[..., :2], rel=1e-12)
    assert not adapted(dimmed)[..., 2].any()


@pytest.mark.parametrize("name", ["dog", "snake", "avian_uv"])
def test_a_grey_scene_is_grey_in_every_picture(name):
    eye = eye_of(name)
    grey = np.linspace(0.1, 1.0, 24).reshape(4, 6)[..., None] * responses(eye).sum(axis=1)
    figure = false_colour_figure(grey, eye)
    pictures = [axes.get_images()[0].get_array() for axes in figure.axes if axes.get_images()]
    assert len(pictures) == len(shown_receptors(len(eye.names)))
    for picture in pictures:
        assert np.ptp(picture, axis=2).max() < 1e-9
        assert np.ptp(picture) > 0.3


def test_a_picture_of_a_column_of_pixels_is_no_larger_than_others():
    figure = false_colour_figure(np.ones((5000, 1, 2)), eye_of("dog"))
    assert figure.get_figheight() < 100.0
