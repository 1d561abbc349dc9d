"""Plugins and tables are Mitsuba's own, whatever lies in the folders of scenes and of the shell."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.plugin.conductors import tabulated_index
from mitsuba_diffraction.plugin.materials import Conductor
from mitsuba_diffraction.scene import load_scene
from tests.support.hostile import other_metals, plugins_in
from tests.support.scenes import searched

pytestmark = pytest.mark.usefixtures("some_variant")

SCENE = '<scene version="3.0.0"><shape type="sphere">{}</shape></scene>'


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of the scene, which is the current one."""
    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")


def loaded(scene: str, **parameters: str) -> Any:
    """The scene of this text, as a file of the current folder."""
    Path("scene.xml").write_text(scene)
    return load_scene(Path("scene.xml"), parameters)


@pytest.fixture
def mark(tmp_path: Path, own_folder: None) -> Path:
    """A file that libraries in the current folder create when they are loaded."""
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
    with pytest.raises(DiffractionError):
        loaded(scene)
    assert not mark.exists()


def test_a_parameter_does_not_choose_a_plugin_beside_the_scene(mark):
    scene = SCENE.format('<default name="kind" value="diffuse"/><bsdf type="$kind"/>')
    loaded(scene)
    with pytest.raises(DiffractionError, match=r"unheard_of\.so"):
        loaded(scene, kind="unheard_of")
    assert not mark.exists()


def test_a_path_does_not_precede_the_own_folder(mark):
    shutil.copytree("plugins", "other/plugins")
    scene = SCENE.format('<bsdf type="hair"/>')
    loaded(scene.replace("<shape", '<path value="other"/><shape', 1))
    assert not mark.exists()


def test_a_plugin_that_is_registered_in_python_loads():
    class Own(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)

        def to_string(self):
            return "Own[]"

    mi.register_bsdf("own-bsdf_2", Own)
    scene = loaded(SCENE.format('<bsdf type="own-bsdf_2"/>'))
    assert isinstance(scene.shapes()[0].bsdf(), Own)


def test_memory_addresses_of_blender_are_refused():
    vertices = '<integer name="verts" value="8"/>'
    with pytest.raises(DiffractionError, match="blender"):
        loaded(SCENE.replace("sphere", "blender").format(vertices))


def test_an_unknown_plugin_is_named():
    with pytest.raises(DiffractionError, match="'difuse'"):
        loaded(SCENE.format('<bsdf type="difuse"/>'))


def test_optical_constants_are_mitsubas(tmp_path):
    other_metals(tmp_path)
    _, index = tabulated_index("Al")
    with searched(tmp_path):
        np.testing.assert_array_equal(tabulated_index("Al")[1], index)
        for name in ("Unobtainium", "../ior/Al", "data/ior/Al"):
            with pytest.raises(DiffractionError, match="unknown"):
                Conductor.of_material(name, 550.0)


def test_conductors_of_a_scene_are_mitsubas():
    scene = SCENE.format('<bsdf type="conductor"><string name="material" value="Al"/></bsdf>')
    alone = str(loaded(scene).shapes()[0].bsdf())
    other_metals(Path.cwd())
    assert str(loaded(scene).shapes()[0].bsdf()) == alone
