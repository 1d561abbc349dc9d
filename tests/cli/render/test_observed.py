"""`render --observer`: channels of receptors, a picture in false colour, refusals."""

from __future__ import annotations

import os

import numpy as np
import OpenEXR
import pytest
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


@pytest.mark.parametrize(
    ("arguments", "code", "named"),
    [
        (["--observer", "dragon"], 1, "avian_uv"),
        (["--observer", "dog", "--denoise"], 2, "one picture in one process"),
        (["--observer", "dog", "-o", "a.png"], 2, "writes an EXR"),
        (["--observer", "dog", "-m", "llvm_ad_rgb"], 1, "spectral"),
        (["--observer", "avian"], 1, "did you mean avian_v or avian_uv?)"),
        (["--observer", "dog", "--illuminant", "leafs"], 1, "did you mean leaves?)"),
        (["--illuminant", "leaves"], 2, "--observer; name one"),
    ],
)
def test_eyes_that_cannot_be_rendered_are_one_line(run, scene, arguments, code, named):
    ran = run("render", scene, *arguments)
    assert ran.code == code
    assert named in ran.err
    assert os.listdir() == ["room.xml"]
