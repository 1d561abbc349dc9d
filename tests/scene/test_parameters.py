"""Which parameters a scene has, includes and all."""

from __future__ import annotations

import json

import mitsuba as mi
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.scene.load import load_scene
from mitsuba_diffraction.scene.parameters import files_of, parameters_of, scene_values
from mitsuba_diffraction.scene.stage import STUDIO
from tests.support.refusals import refused
from tests.support.room import scene_file


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "light.xml").write_text(
        '<scene version="3.0.0"><default name="power" value="2"/>'
        '<float name="x" value="$power"/></scene>'
    )
    return scene_file(
        tmp_path,
        '<default name="spp" value="16"/><default name="part" value="light"/>',
        '<include filename="parts/$part.xml"/><string name="n" value="a $needed b"/>',
    )


def test_defaults_and_uses_are_found_in_includes_too(scene):
    assert parameters_of(scene) == {"spp": "16", "part": "light", "power": "2", "needed": None}


def test_of_two_defaults_the_first_counts(tmp_path):
    defaults = [f'<default name="a" value="{value}"/>' for value in (1, 2)]
    assert parameters_of(scene_file(tmp_path, *defaults, '<float name="x" value="$a"/>')) == {
        "a": "1"
    }


def test_an_unknown_parameter_is_answered_with_those_there_are(scene):
    with pytest.raises(DiffractionError) as caught:
        scene_values(scene, {"sp": "4"})
    text = str(caught.value)
    assert "no parameter 'sp'; it has (with defaults) spp=16, part=light" in text
    assert text.endswith("did you mean spp?")
    assert "\n" not in text


def test_a_given_value_chooses_the_include(scene):
    (scene.parent / "parts" / "other.xml").write_text(
        '<scene version="3.0.0"><default name="colour" value="red"/></scene>'
    )
    assert "colour" in parameters_of(scene, {"part": "other"})


def test_a_circle_of_includes_ends(tmp_path):
    assert parameters_of(scene_file(tmp_path, '<include filename="scene.xml"/>')) is None


@given(st.binary(max_size=200))
def test_files_that_are_no_xml_are_refused(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("any") / "scene.xml"
    file.write_bytes(content)
    with pytest.raises(DiffractionError, match=f"'{file}'"):
        scene_values(file, {"spp": "1"})


@pytest.fixture
def folder(tmp_path):
    """Folder of a scene; in the folder around it lies a file that the scene may not read."""
    (tmp_path / "private.xml").write_text(LIGHT)
    folder = tmp_path / "scene"
    (folder / "parts").mkdir(parents=True)
    (folder / "light.xml").write_text(LIGHT)
    (folder / "link.xml").symlink_to(tmp_path / "private.xml")
    (folder / "outside").symlink_to(tmp_path)
    (folder / "parts" / "nested.xml").write_text(
        '<scene version="3.0.0"><include filename="../light.xml"/></scene>'
    )
    (folder / "parts" / "leaves.xml").write_text(
        '<scene version="3.0.0"><include filename="../private.xml"/></scene>'
    )
    return folder


LIGHT = '<scene version="3.0.0"><emitter type="constant"/></scene>'


INSIDE = {
    "beside": ['<include filename="light.xml"/>'],
    "nested": ['<include filename="parts/nested.xml"/>'],
    "by a folder": ['<path value="parts"/>', '<include filename="nested.xml"/>'],
    "of the package": [f'<include filename="{STUDIO.with_name("lamp.xml")}"/>'],
}
OUTSIDE = {
    "above": ['<include filename="../private.xml"/>'],
    "absolute": ['<include filename="{outside}/private.xml"/>'],
    "link": ['<include filename="link.xml"/>'],
    "linked folder": ['<include filename="outside/private.xml"/>'],
    "nested": ['<include filename="parts/leaves.xml"/>'],
    "default": ['<default name="a" value="../private"/>', '<include filename="$a.xml"/>'],
    "folder": ['<path value=".."/>', '<include filename="private.xml"/>'],
    "linked path": ['<path value="outside"/>'],
    "of no folder": ['<include filename="parts/../../private.xml"/>'],
    "entity": ['<include filename="&#46;&#46;/private.xml"/>'],
    "no XML": ['<include filename="../private.xml"/><!-- -- -->'],
}


@pytest.mark.usefixtures("some_variant")
@pytest.mark.parametrize("case", INSIDE)
def test_includes_in_the_folder_load(folder, case):
    assert len(load_scene(scene_file(folder, *INSIDE[case]), {}).emitters()) == 1


@pytest.mark.usefixtures("some_variant")
@pytest.mark.parametrize("case", OUTSIDE)
def test_nothing_outside_of_the_folder_is_included(folder, case, monkeypatch):
    scene = scene_file(folder, *(text.format(outside=folder.parent) for text in OUTSIDE[case]))
    monkeypatch.setattr(mi.parser, "parse_file", lambda *_, **__: pytest.fail("it was parsed"))
    refused(lambda: load_scene(scene, {}), r"outside of|malformed")


@pytest.mark.usefixtures("some_variant")
def test_an_include_that_only_mitsuba_sees_is_refused(folder):
    """Python expands the entity of a document type, and Mitsuba takes its name as it stands."""
    (folder / "&a;").symlink_to(folder.parent / "private.xml")
    scene = scene_file(folder, '<include filename="&a;"/>')
    scene.write_text('<!DOCTYPE scene [<!ENTITY a "light.xml">]>' + scene.read_text())
    with pytest.raises(DiffractionError):
        load_scene(scene, {})


@pytest.mark.usefixtures("some_variant")
def test_the_user_chooses_an_include_anywhere(folder):
    """Together with what that file includes from its own folder."""
    outside = folder.parent / "user.xml"
    outside.write_text('<scene version="3.0.0"><include filename="private.xml"/></scene>')
    scene = scene_file(
        folder, '<default name="light" value="light.xml"/><include filename="$light"/>'
    )
    assert len(load_scene(scene, {"light": str(outside)}).emitters()) == 1


def test_only_files_that_plugins_read_are_listed(folder):
    """A list of files is sent to workers: a private file that a scene merely names is not."""
    outside = folder.parent
    for name in ("heights.npy", "table.nc", "mesh.ply", "index.spd", "layers.toml", "id_rsa"):
        (outside / name).write_text("x")
    scene = scene_file(
        folder,
        f'<default name="key" value="{outside}/id_rsa"/>',
        f'<default name="heights" value="{outside}/heights.npy"/>',
        f'<string name="unread" value="{outside}/id_rsa"/><string name="key" value="$key"/>',
        f'<bsdf type="diffraction" id="{outside}/id_rsa">',
        '<string name="filename" value="$heights"/>',
        '<string name="filename" value="../table.nc"/>',
        '<string name="layers" value="../layers.toml"/>',
        '<spectrum name="eta" filename="../index.spd"/></bsdf>',
        '<shape type="ply"><string name="filename" value="../mesh.ply"/></shape>',
        '<include filename="parts/nested.xml"/>',
    )
    names = {file.name for file in files_of(scene)}
    assert names == {
        "scene.xml", "heights.npy", "table.nc", "layers.toml", "index.spd", "mesh.ply",
        "nested.xml", "light.xml",
    }  # fmt: skip


def test_files_are_found_where_mitsuba_looks_for_them(folder, monkeypatch, tmp_path):
    """In folders of <path>, beside the scene, and in the current folder; never beside includes."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for place in ("here/current.ply", "scene/parts/mesh.ply", "scene/beside.ply"):
        (tmp_path / place).write_text("x")
    shape = '<shape type="ply"><string name="filename" value="{}.ply"/></shape>'
    meshes = [shape.format(name) for name in ("current", "beside", "mesh")]
    scene = scene_file(folder, *meshes)
    assert {file.name for file in files_of(scene)} == {"scene.xml", "current.ply", "beside.ply"}
    scene = scene_file(folder, '<path value="parts"/>', *meshes)
    assert len(files_of(scene)) == 4


def test_files_of_heights_and_recipes_are_listed_too(tmp_path):
    (tmp_path / "scan.npy").write_bytes(b"\x93NUMPY")
    (tmp_path / "scan.toml").write_text('source = "scan.npy"\npixel_size = 0.1\n')
    assert files_of(tmp_path / "scan.npy") == [tmp_path / "scan.npy"]
    assert {file.name for file in files_of(tmp_path / "scan.toml")} == {"scan.npy", "scan.toml"}


def test_buffers_and_pictures_of_a_gltf_are_listed_too(tmp_path):
    """A frame is rendered again, and a worker has the file, if one of them changes."""
    names = ["../outside.bin", "parts/a%20b.bin", "data:,x", "lost.bin"]
    document = {"buffers": [{"uri": name} for name in names], "images": [{"uri": "c.png"}, {}]}
    (tmp_path / "outside.bin").write_bytes(b"x")
    (tmp_path / "scene" / "parts").mkdir(parents=True)
    scene = scene_file(tmp_path / "scene", '<string name="filename" value="m.gltf"/>')
    (tmp_path / "scene/m.gltf").write_text(json.dumps(document))
    for name in ("parts/a b.bin", "c.png"):
        (tmp_path / "scene" / name).write_bytes(b"x")
    assert {file.name for file in files_of(scene)} == {"scene.xml", "m.gltf", "a b.bin", "c.png"}
