"""shaders/display.glsl against its twin in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.colour import delta_e, linear_srgb, response
from mitsuba_diffraction.optics.display import VIEWS, shown
from mitsuba_diffraction.realtime.glsl.source import display_definitions, plain_source

SHOW = """
uniform sampler2D light;
out vec4 fragment;
void main() { fragment = vec4(displayed(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb), 1.0); }
"""


@pytest.mark.parametrize("view", VIEWS)
def test_shader_and_numpy_show_the_same(gl, view):
    lines = linear_srgb(response(np.linspace(390.0, 720.0, 128))) * 100.0
    noise = np.random.default_rng(2).normal(0.3, 0.7, (31, 128, 3))
    stops = 2.0 ** np.arange(-15.0, 16.0)[:, None, None]
    light = np.concatenate([stops * lines, noise, stops * noise]).astype(np.float32)
    rows, columns, _ = light.shape
    source = plain_source("shown.frag", ("library.glsl", "display.glsl"), display_definitions(view))
    program = gl.program(
        vertex_shader=plain_source("whole.vert"),
        fragment_shader=source.partition("// Picture of a page")[0] + SHOW,
    )
    texture = gl.texture((columns, rows), 3, light.tobytes(), dtype="f4")
    target = gl.texture((columns, rows), 4, dtype="f4")
    frame = gl.framebuffer([target])
    frame.use()
    texture.use(0)
    gl.vertex_array(program, []).render(vertices=3)
    drawn = np.frombuffer(frame.read(components=3, dtype="f4"), np.float32).reshape(light.shape)
    expected = shown(light, view)
    # single precision with a driver's powers; 1/255 is a step of a screen
    assert np.abs(drawn - expected).max() < 1e-3
    linear = [np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
              for c in (expected, drawn.astype(float))]  # fmt: skip
    assert delta_e(*linear, exposure=1.0, least=0.0).max() < 0.5
