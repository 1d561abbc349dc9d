"""Mitsuba's errors and warnings as lines of our own."""

from __future__ import annotations

import mitsuba as mi
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.cli.console import mitsuba_warnings
from mitsuba_diffraction.scene.load import plain_text

# as Mitsuba 3.9.1 throws them
CASES = {
    "[parser.cpp:451] Error while loading a.xml (line 6, col 133): undefined parameter: $spp": (
        "'a.xml', line 6: undefined parameter: $spp"
    ),
    '[parser.cpp:1718] At a.xml (line 8, col 25): failed to instantiate bsdf plugin of type "x": '
    '[PluginManager] Plugin "x" not found!': (
        "'a.xml', line 8: there is no bsdf plugin 'x'; check the name"
    ),
    "[parser.cpp:444] While loading a.xml (line 8, col 25): Found 1 unreferenced property in bsdf "
    'plugin of type "diffuse":\n  - float "foo": 1': (
        "'a.xml', line 8: bsdf 'diffuse' has no such parameter: float \"foo\": 1"
    ),
    '[parser.cpp:1718] At a.xml (line 8, col 25): failed to instantiate bsdf plugin of type "y": '
    'Traceback (most recent call last):\n  File "/a/b.py", line 12, in <module>\n  File "/a/b.py",'
    " line 8, in __init__\nmitsuba_diffraction.errors.DiffractionError: 'p.png' does not exist": (
        "'a.xml', line 8: bsdf 'y': 'p.png' does not exist"
    ),
    "[parser.cpp:451] Error while loading a.xml (line 1, col 25): while processing <include>:\n"
    '[parser.cpp:451] Error while loading b.xml (line 3, col 5): could not parse integer value "c"':
    "'b.xml', line 3: while processing <include>: could not parse integer value \"c\"",
    '[parser.cpp:1718] At a.xml (line 2, col 5): failed to instantiate shape plugin of type "ply": '
    '[ply.cpp:136] Error while loading PLY file "/m/ball.obj": "/m/ball.obj": invalid PLY header: '
    'unknown token "#"!': (
        "'a.xml', line 2: shape 'ply': '/m/ball.obj' is no PLY mesh, which the scene expects: run "
        "'mitsuba-diffraction tangents /m/ball.obj -o mesh.ply' first, and use mesh.ply"
    ),
    # quads, in binary and as text
    '[parser.cpp:1718] At a.xml (line 2, col 5): failed to instantiate shape plugin of type "ply": '
    '[PLYMesh] Error while loading PLY file "q.ply": incompatible contents -- is this a triangle '
    "mesh?!": (
        "'a.xml', line 2: shape 'ply': 'q.ply' has polygons, of which Mitsuba reads only "
        "triangles: run 'mitsuba-diffraction tangents q.ply -o mesh.ply' first, and use mesh.ply"
    ),
    '[parser.cpp:1718] At a.xml (line 2, col 5): failed to instantiate shape plugin of type "ply": '
    '[PLYMesh] Error while loading PLY file "t.ply": [ply.h:268] "t.ply": trailing tokens after '
    "end of PLY file!": (
        "'a.xml', line 2: shape 'ply': 't.ply' has polygons, of which Mitsuba reads only "
        "triangles: run 'mitsuba-diffraction tangents t.ply -o mesh.ply' first, and use mesh.ply"
    ),
}  # fmt: skip


@pytest.mark.parametrize("text", CASES)
def test_errors_say_where_and_what(text):
    assert plain_text(RuntimeError(text)) == CASES[text]


@given(st.text())
def test_any_error_is_one_line(text):
    assert len(plain_text(RuntimeError(text)).splitlines()) <= 1


def test_mitsuba_s_warnings_are_ours_and_said_once(capfd):
    mi.set_variant("scalar_rgb")
    count = mi.logger().appender_count()
    with mitsuba_warnings():
        for _ in range(2):
            mi.Log(mi.LogLevel.Warn, "too few\nsamples")
        mi.Log(mi.LogLevel.Info, "of no interest")
    assert capfd.readouterr().err.splitlines() == ["mitsuba-diffraction: warning: too few samples"]
    assert mi.logger().appender_count() == count
