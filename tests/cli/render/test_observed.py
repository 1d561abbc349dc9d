"""`render --observer`: channels of receptors, a picture in false colour, refusals."""

from __future__ import annotations

import numpy as np
import OpenEXR
from PIL import Image

from tests.support.room import SCENE

__all__ = ["SCENE"]  # read by the fixture `scene`


def test_the_exr_has_a_channel_for_each_receptor_and_the_png_a_legend(run, scene):
    ran = run(
        "render", scene, "-m", "scalar_spectral", "-s", "16", "--observer", "dog", "-o", "a.exr"
    )
    assert ran.code == 0, ran.err
    assert "channels s, l" in ran.out
    channels = OpenEXR.File("a.exr").channels()
    assert set(channels) == {"s", "l"}
    # the room's light is white: daylight has less power at 429 nm than at 555 nm
    short, long = (float(np.mean(channels[name].pixels)) for name in ("s", "l"))
    assert 0.0 < short < long
    with Image.open("a.png") as picture:
        assert picture.width > 400
