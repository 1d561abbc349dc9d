"""`render --observer` of every eye: known light has known catches in each channel."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction.analysis.observers import EYES, GRID, eye_of, illuminant_of, responses
from tests.support.room import SCENE

pytestmark = pytest.mark.thorough

# radiance of 1 per nanometre, and nothing else to be seen
_WHITE = SCENE.replace(
    '<rgb name="radiance" value="0.5"/>', '<spectrum name="radiance" value="1"/>'
)
_EMPTY = _WHITE.replace('<shape type="sphere"><bsdf type="diffuse"/></shape>', "")


@pytest.mark.parametrize(
    ("name", "light"), [*((name, None) for name in EYES), ("avian_uv", "leaves")]
)
def test_a_scene_of_white_light_has_the_catches_of_that_light(run, here, name, light):
    (here / "white.xml").write_text(_EMPTY)
    asked = ["--illuminant", light] if light else []
    run("render", "white.xml", "-m", "scalar_spectral", "-s", "64", "--observer", name,
        *asked, "-o", "a.exr").succeeded()  # fmt: skip
    eye = eye_of(name)
    channels = OpenEXR.File("a.exr").channels()
    assert set(channels) == set(eye.names)
    # D65 becomes the other light: a spectrum of 1 is multiplied by their ratio
    ratio = illuminant_of("leaves") / illuminant_of("d65") if light else np.ones_like(GRID)
    expected = [float(row @ ratio) for row in responses(eye)]
    means = [float(np.mean(channels[n].pixels)) for n in eye.names]
    # 24 x 16 pixels of 64 samples: the noise of the wavelengths drawn is about 1 %
    assert means == pytest.approx(expected, rel=0.04)
