"""`displayed` of the shaders against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.display import VIEWS, shown
from mitsuba_diffraction.realtime.glsl.source import display_definitions, plain_source
from tests.support.display import largest_difference, ramp

SHOW = """
uniform sampler2D light;
out vec4 fragment;
void main() { fragment = vec4(displayed(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb), 1.0); }
"""


@pytest.mark.parametrize("view", VIEWS)
def test_shader_and_numpy_show_the_same(gl, view):
    light = ramp()
    rows, columns, _ = light.shape
    source = plain_source("shown.frag", ("library.glsl", "formulas"), display_definitions(view))
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
    assert largest_difference(expected, drawn) < 0.5
