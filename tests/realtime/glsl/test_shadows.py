"""Parts of a scene that a shadow map covers."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.realtime.glsl.shadows import outline


def test_an_outline_reaches_as_far_as_what_it_is_of() -> None:
    places = np.random.default_rng(0).normal(size=(5000, 3))
    directions = np.random.default_rng(1).normal(size=(3, 200))
    for some in (places, places * [1.0, 1.0, 0.0], places[:3]):
        around = outline(some)
        assert len(around) < 400 or not some[:, 2].any()
        assert np.allclose((around @ directions).max(axis=0), (some @ directions).max(axis=0))
