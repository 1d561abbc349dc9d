"""Plugins and tables are Mitsuba's own, whatever lies in the folders of scenes and of the shell."""

from __future__ import annotations

import shutil
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.plugin.conductors import tabulated_index
from mitsuba_diffraction.plugin.materials import Conductor
from mitsuba_diffraction.scene import load_scene
from tests.support.hostile import other_metals, plugins_in

pytestmark = pytest.mark.usefixtures("some_variant")

SCENE = '<scene version="3.0.0"><shape type="sphere">{}</shape></scene>'


@pytest.fixture
def mark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that libraries in the current folder create when they are loaded."""
    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    return plugins_in(Path.cwd(), tmp_path / "ran", ["unheard_of", "hair", "hdrfilm", "../outside"])


@pytest.mark.parametrize(
    "kind",
    [
        "unheard_of", "plugins/unheard_of", "../outside", "../plugins/unheard_of", "..",
        "unheard_of.so", "unheard_of.bsdf", "/etc/unheard_of", "",
    ],
)  # fmt: skip
@pytest.mark.parametrize("include", [False, True])
def test_a_plugin_beside_the_scene_is_refused(mark, kind, include):
    scene = SCENE.format(f'<bsdf type="{kind}"/>')
    if include:
        Path("part.xml").write_text(scene)
        scene = '<scene version="3.0.0"><include filename="part.xml"/></scene>'
    Path("scene.xml").write_text(scene)
    with pytest.raises(DiffractionError):
        load_scene(Path("scene.xml"), {})
    assert not mark.exists()


def test_a_parameter_does_not_choose_a_plugin_beside_the_scene(mark):
    Path("scene.xml").write_text(
        SCENE.format('<default name="kind" value="diffuse"/><bsdf type="$kind"/>')
    )
    load_scene(Path("scene.xml"), {})
    with pytest.raises(DiffractionError, match=r"unheard_of\.so"):
        load_scene(Path("scene.xml"), {"kind": "unheard_of"})
    assert not mark.exists()


def test_a_path_does_not_precede_the_own_folder(mark):
    shutil.copytree("plugins", "other/plugins")
    Path("scene.xml").write_text(
        SCENE.format('<bsdf type="hair"/>').replace("<shape", '<path value="other"/><shape', 1)
    )
    load_scene(Path("scene.xml"), {})
    assert not mark.exists()


def test_a_plugin_that_is_registered_in_python_loads(tmp_path):
    class Own(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)

        def to_string(self):
            return "Own[]"

    mi.register_bsdf("own-bsdf_2", Own)
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.format('<bsdf type="own-bsdf_2"/>'))
    assert isinstance(load_scene(file, {}).shapes()[0].bsdf(), Own)


def test_memory_addresses_of_blender_are_refused(tmp_path):
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.replace("sphere", "blender").format('<integer name="verts" value="8"/>'))
    with pytest.raises(DiffractionError, match="blender"):
        load_scene(file, {})


def test_an_unknown_plugin_is_named(tmp_path):
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.format('<bsdf type="difuse"/>'))
    with pytest.raises(DiffractionError, match="'difuse'"):
        load_scene(file, {})


def test_optical_constants_are_mitsubas(tmp_path):
    other_metals(tmp_path)
    before = mi.file_resolver()
    _, index = tabulated_index("Al")
    try:
        resolver = mi.FileResolver(before)
        resolver.prepend(str(tmp_path))
        mi.set_file_resolver(resolver)
        np.testing.assert_array_equal(tabulated_index("Al")[1], index)
        for name in ("Unobtainium", "../ior/Al", "data/ior/Al"):
            with pytest.raises(DiffractionError, match="unknown"):
                Conductor.of_material(name, 550.0)
    finally:
        mi.set_file_resolver(before)


def test_conductors_of_a_scene_are_mitsubas(tmp_path):
    file = tmp_path / "scene.xml"
    file.write_text(
        SCENE.format('<bsdf type="conductor"><string name="material" value="Al"/></bsdf>')
    )
    alone = str(load_scene(file, {}).shapes()[0].bsdf())
    other_metals(tmp_path)
    assert str(load_scene(file, {}).shapes()[0].bsdf()) == alone
