"""What a page and the desktop draw, as numbers; light to show, and differences of pictures."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.colour import delta_e, linear_srgb, response

_READ = """async ([shadows, samples]) => {
    viewer.most = samples;  // the first one through the middles of pixels, as the desktop's
    viewer.shadows = shadows;
    viewer.touch();
    await viewer.settled(samples);
    const { gl, sums, width, height } = viewer.drawing, sum = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, sums[0].frame);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, sum);
    const mean = sum.map((x) => x / viewer.count);
    let text = "";
    for (const byte of new Uint8Array(mean.buffer)) text += String.fromCharCode(byte);
    return [btoa(text), width, height];
}"""


def picture(tab: Any, *, shadows: bool = False, samples: int = 1) -> NDArray[np.float32]:
    """Linear sRGB and coverage (height, width, 4), from the top row down."""
    text, width, height = tab.page.evaluate(_READ, [shadows, samples])
    return np.frombuffer(base64.b64decode(text), np.float32).reshape(height, width, 4)[::-1]


def desktop_renderer(scene: Any) -> Any:
    """The desktop's renderer of a scene; skips the test where shaders do not run."""
    pytest.importorskip("moderngl")
    from mitsuba_diffraction.realtime.glsl import Renderer

    try:
        return Renderer(scene)
    except DiffractionError as error:
        pytest.skip(str(error))


def by_methods(scene: Any, *methods: str) -> dict[str, NDArray[np.float32]]:
    """The desktop's pictures of one sample, by method."""
    renderer = desktop_renderer(scene)
    found = {method: renderer.render(method, supersampling=1) for method in methods}
    renderer.release()
    return found


def of_the_desktop(scene: Any, frames: int, bounces: bool = False) -> NDArray[np.float32]:
    """What `Renderer` draws of all direct light, and on request of light between surfaces."""
    renderer = desktop_renderer(scene)
    light = renderer.progressive("fast", bounces=bounces)
    light.advance(frames)
    found: NDArray[np.float32] = light.image
    light.release()
    renderer.release()
    return found


def ramp() -> NDArray[np.float32]:
    """Spectral colours and random ones over 31 stops, linear sRGB (93, 128, 3)."""
    lines = linear_srgb(response(np.linspace(390.0, 720.0, 128))) * 100.0
    noise = np.random.default_rng(2).normal(0.3, 0.7, (31, 128, 3))
    stops = 2.0 ** np.arange(-15.0, 16.0)[:, None, None]
    return np.concatenate([stops * lines, noise, stops * noise]).astype(np.float32)


def largest_difference(expected: NDArray[np.floating], drawn: NDArray[np.floating]) -> float:
    """ΔE2000 between two pictures in sRGB that differ most."""
    linear = [
        np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
        for c in (expected.astype(float), drawn.astype(float))
    ]
    return float(delta_e(*linear, exposure=1.0, least=0.0).max())
