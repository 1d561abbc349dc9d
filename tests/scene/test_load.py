"""What `render` finds out about a scene after loading it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.scene.load import load_scene

BSDF = (
    '<bsdf type="diffraction"><string name="heightfield" value="grating.npy"/>'
    '<float name="pixel_size" value="0.08"/><float name="coherence_width" value="4"/>'
    '<boolean name="energy_conserving" value="false"/></bsdf>'
)
TWOSIDED = f'<bsdf type="twosided">{BSDF}</bsdf>'
FOLLOWING = BSDF.replace(
    "</bsdf>",
    '<texture type="mesh_attribute" name="orientation"><string name="name" '
    'value="vertex_orientation"/></texture></bsdf>',
)
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.fixture
def scene_of(tmp_path, monkeypatch):
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    np.save("grating.npy", np.tile(0.01 * np.sin(np.pi * np.arange(60) / 30), (60, 1)))

    def write(mesh: str, bsdf: str):
        (tmp_path / "mesh.obj").write_text(mesh)
        file = tmp_path / "scene.xml"
        file.write_text(
            '<scene version="3.0.0"><shape type="obj" id="hide">'
            f'<string name="filename" value="mesh.obj"/>{bsdf}</shape></scene>'
        )
        return file

    return write


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("bsdf", [BSDF, TWOSIDED])
def test_a_mesh_without_texture_coordinates_is_named(scene_of, bsdf):
    with pytest.warns(DiffractionWarning, match="no texture coordinates on hide"):
        load_scene(scene_of(TRIANGLE + "f 1 2 3\n", bsdf), {})


@pytest.mark.usefixtures("variant")
def test_shapes_without_id_are_named_by_file_or_place(scene_of):
    file = scene_of(TRIANGLE + "f 1 2 3\n", BSDF)
    file.write_text(file.read_text().replace(' id="hide"', ""))
    with pytest.warns(
        DiffractionWarning, match=r"coordinates on shape 1 \(the mesh mesh\.obj\): the"
    ):
        load_scene(file, {})
    file.write_text(
        f'<scene version="3.0.0"><shape type="sphere"/><shape type="sphere">{FOLLOWING}</shape>'
        "</scene>"
    )
    with pytest.raises(
        DiffractionError, match=r"^shape 2 \(a sphere without id\) has no .* or use a mesh$"
    ):
        load_scene(file, {})


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize(
    ("mesh", "bsdf"),
    [
        (TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n", BSDF),
        (TRIANGLE + "f 1 2 3\n", '<bsdf type="diffuse"/>'),
    ],
)
def test_no_other_mesh_is(scene_of, mesh, bsdf):
    with warnings.catch_warnings():
        warnings.simplefilter("error", DiffractionWarning)
        load_scene(scene_of(mesh, bsdf), {})


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("bsdf", [FOLLOWING, f'<bsdf type="twosided">{FOLLOWING}</bsdf>'])
def test_a_mesh_without_the_field_that_turns_the_patch_is_refused(scene_of, bsdf):
    """Kernels would go on with zeros, and not turn it."""
    with pytest.raises(DiffractionError, match=r"hide has no attribute vertex_.* tangents MESH"):
        load_scene(scene_of(TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n", bsdf), {})
