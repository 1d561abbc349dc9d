"""What a page and the desktop draw, as numbers."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionError

_READ = """async ([shadows, samples]) => {
    viewer.most = samples;  // the first one through the middles of pixels, as the desktop's
    viewer.shadows = shadows;
    viewer.touch();
    await viewer.settled(samples);
    let text = "";
    for (const byte of new Uint8Array(viewer.drawing.read(viewer.count).buffer))
        text += String.fromCharCode(byte);
    return [btoa(text), viewer.drawing.width, viewer.drawing.height];
}"""


def picture(tab: Any, *, shadows: bool = False, samples: int = 1) -> NDArray[np.float32]:
    """Linear sRGB and coverage (height, width, 4), from the top row down."""
    text, width, height = tab.page.evaluate(_READ, [shadows, samples])
    return np.frombuffer(base64.b64decode(text), np.float32).reshape(height, width, 4)[::-1]


def of_the_desktop(scene: Any, frames: int, bounces: bool = False) -> NDArray[np.float32]:
    """What `Renderer` draws of all direct light, and on request of light between surfaces.

    Skips the test where shaders do not run.
    """
    pytest.importorskip("moderngl")
    from mitsuba_diffraction.realtime.glsl import Renderer

    try:
        renderer = Renderer(scene)
    except DiffractionError as error:
        pytest.skip(str(error))
    light = renderer.progressive("fast", bounces=bounces)
    light.advance(frames)
    found: NDArray[np.float32] = light.image
    light.release()
    renderer.release()
    return found
