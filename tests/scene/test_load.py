"""What is found out about a scene after loading it; Mitsuba's errors as lines of our own."""

from __future__ import annotations

import warnings

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.scene.load import load_scene
from mitsuba_diffraction.scene.mitsuba_errors import plain_text
from tests.support.room import SKIN, scene_file, skin

TWOSIDED = f'<bsdf type="twosided">{SKIN}</bsdf>'
FOLLOWING = skin(
    '<texture type="mesh_attribute" name="orientation"><string name="name" '
    'value="vertex_orientation"/></texture>'
)
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TRIANGLE = f"{CORNERS}f 1 2 3\n"
UNWRAPPED = f"{CORNERS}vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"

# as Mitsuba 3.9.1 throws them, of files that our own checks let pass: others have tests as scenes
CASES = {
    '[parser.cpp:1718] At a.xml (line 8, col 25): failed to instantiate bsdf plugin of type "y": '
    'Traceback (most recent call last):\n  File "/a/b.py", line 12, in <module>\nRuntimeError: '
    '[parser.cpp:1718] At dictionary node "root": failed to instantiate bsdf plugin of type "z": '
    'Traceback (most recent call last):\n  File "/a/b.py", line 9, in __init__\n'
    "mitsuba_diffraction.errors.DiffractionError: unknown parameter 'k'": (
        "'a.xml', line 8: bsdf 'y': bsdf 'z': unknown parameter 'k'"
    ),
    "[parser.cpp:451] Error while loading a.xml (line 1, col 25): while processing <include>:\n"
    '[parser.cpp:451] Error while loading b.xml (line 3, col 5): could not parse integer value "c"':
    "'b.xml', line 3: while processing <include>: could not parse integer value \"c\"",
    # quads, in binary and as text
    **{
        '[parser.cpp:1718] At a.xml (line 2, col 5): failed to instantiate shape plugin of type '
        f'"ply": [PLYMesh] Error while loading PLY file "q.ply": {said}': (
            "'a.xml', line 2: shape 'ply': 'q.ply' has polygons, of which Mitsuba reads only "
            "triangles: run the command 'tangents q.ply -o mesh.ply' first, and use mesh.ply"
        )
        for said in ("incompatible contents -- is this a triangle mesh?!",
                     '[ply.h:268] "q.ply": trailing tokens after end of PLY file!')
    },
}  # fmt: skip


def obj_scene(folder, mesh, bsdf):
    """Write a scene of a mesh, and the mesh beside it."""
    (folder / "mesh.obj").write_text(mesh)
    name = '<string name="filename" value="mesh.obj"/>'
    return scene_file(folder, f'<shape type="obj" id="hide">{name}{bsdf}</shape>')


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("bsdf", [SKIN, TWOSIDED])
def test_a_mesh_without_texture_coordinates_is_named(tmp_path, bsdf):
    with pytest.warns(DiffractionWarning, match="no texture coordinates on hide"):
        load_scene(obj_scene(tmp_path, TRIANGLE, bsdf), {})


@pytest.mark.usefixtures("variant")
def test_shapes_without_id_are_named_by_file_or_place(tmp_path):
    file = obj_scene(tmp_path, TRIANGLE, SKIN)
    file.write_text(file.read_text().replace(' id="hide"', ""))
    with pytest.warns(
        DiffractionWarning, match=r"coordinates on shape 1 \(the mesh mesh\.obj\): the"
    ):
        load_scene(file, {})
    scene_file(tmp_path, f'<shape type="sphere"/><shape type="sphere">{FOLLOWING}</shape>')
    with pytest.raises(
        DiffractionError, match=r"^shape 2 \(a sphere without id\) has no .* or use a mesh$"
    ):
        load_scene(file, {})


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize(
    ("mesh", "bsdf"),
    [
        (UNWRAPPED, SKIN),
        (TRIANGLE, '<bsdf type="diffuse"/>'),
    ],
)
def test_no_other_mesh_is(tmp_path, mesh, bsdf):
    with warnings.catch_warnings():
        warnings.simplefilter("error", DiffractionWarning)
        load_scene(obj_scene(tmp_path, mesh, bsdf), {})


@pytest.mark.parametrize("text", CASES)
def test_errors_say_where_and_what(text):
    assert plain_text(RuntimeError(text)) == CASES[text]


@given(st.text())
def test_any_error_is_one_line(text):
    assert len(plain_text(RuntimeError(text)).splitlines()) <= 1
