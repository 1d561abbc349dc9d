"""The plugins: there in every variant, by named looks, and Mitsuba's own whatever folders hold."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.files import FileKind, kind_of
from mitsuba_diffraction.heights import Source
from mitsuba_diffraction.plugin.conductors import tabulated_index
from mitsuba_diffraction.plugin.materials import Conductor
from mitsuba_diffraction.plugin.parameters import NAMES
from mitsuba_diffraction.plugin.presets import find_preset, presets
from mitsuba_diffraction.scene import load_scene
from tests.support import ROOT
from tests.support.gentle import load, pairs
from tests.support.hostile import other_metals, plugins_in
from tests.support.lanes import evaluated
from tests.support.scenes import searched


def test_variants_may_be_switched_back_and_forth(some_variant):
    wi, wo, lam = pairs(20)
    first = load()
    before = evaluated(first, wi, wo, lam[:, None])
    for name in ("scalar_rgb", "llvm_ad_rgb", some_variant):
        mi.set_variant(name)
    assert np.array_equal(evaluated(load(), wi, wo, lam[:, None]), before)
    assert np.array_equal(evaluated(first, wi, wo, lam[:, None]), before)  # still of use


# Mitsuba 3.10 imports the modules of entry points, and reloads them at each change of variant
DISCOVERY = """
import importlib, sys, tomllib, mitsuba as mi
entries = tomllib.load(open('pyproject.toml', 'rb'))['project']['entry-points']['mitsuba']
for name in ('scalar_rgb', '{0}', 'llvm_ad_rgb', '{0}'):
    mi.set_variant(name)
    for module in entries.values():
        if module in sys.modules:
            importlib.reload(sys.modules[module])
        else:
            importlib.import_module(module)
md = sys.modules['mitsuba_diffraction']
"""

LOADS = """
import numpy as np
heights = 0.01 * np.sin(np.arange(64) / 64 * 2 * np.pi)[None, :] + np.zeros((64, 1))
def check():
    own = {'coherence_width': 5.0, 'energy_conserving': False}
    b = mi.load_dict(md.bsdf_dict(md.HeightField(heights, 0.08), **own))
    assert 'Diffraction[' in str(b), b
"""


@pytest.mark.parametrize(
    "order",
    [
        pytest.param(
            "import mitsuba as mi; mi.set_variant('{0}'); import mitsuba_diffraction as md",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            "from mitsuba_diffraction import bsdf_dict; import mitsuba as mi; "
            "mi.set_variant('{0}'); import mitsuba_diffraction as md",
            marks=pytest.mark.thorough,
        ),
        "import mitsuba as mi; import mitsuba_diffraction as md; mi.set_variant('scalar_rgb'); "
        "mi.set_variant('{0}'); mi.set_variant('llvm_ad_rgb'); mi.set_variant('{0}')",
        pytest.param(DISCOVERY, marks=pytest.mark.thorough),
    ],
    ids=["variant first", "one name first", "several variants", "discovered by Mitsuba"],
)
def test_the_plugin_is_there_whenever_it_is_imported(some_variant, order):
    code = f"{order.format(some_variant)}\n{LOADS}\ncheck()"
    result = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:mitsuba_diffraction", "-c", code],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (result.returncode, result.stderr) == (0, "")


PRESETS = presets()


@pytest.mark.parametrize("name", PRESETS)
def test_every_record_has_a_patch_and_parameters_of_its_plugin(name):
    look = PRESETS[name]
    assert look.about
    assert set(look.parameters) <= set(NAMES[look.plugin])
    if kind_of(look.patch) is not FileKind.ORDERS:
        assert Source.of(look.patch).generator


@pytest.mark.parametrize(
    ("wrong", "near"),
    [("cdd", "did you mean cd"), ("snak", "snake"), ("FOIL", "-foil"), ("", "cd, dvd")],
)
def test_an_unknown_name_is_answered_with_the_nearest(wrong, near):
    with pytest.raises(DiffractionError, match=near):
        find_preset(wrong)


def test_changes_replace_the_whole_material_of_a_look():
    changed = md.preset("snake", int_ior=1.6, orientation=None)
    assert changed["int_ior"] == 1.6
    assert "material" not in changed
    assert "orientation" not in changed
    assert changed["pigment"] == md.preset("snake")["pigment"]


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "scalar_spectral"])
def test_the_plugin_is_the_bsdf_of_the_dictionary(variant):
    mi.set_variant(variant)
    xml = """<bsdf version="3.0.0" type="diffraction_preset" id="disc">
        <string name="preset" value="dvd"/><float name="orientation" value="90"/></bsdf>"""
    bsdf = mi.load_string(xml)
    assert bsdf.id() == "disc"
    assert str(bsdf) == str(mi.load_dict(md.preset("dvd", orientation=90)))
    assert "orientation = 90" in str(bsdf)


def test_the_plugin_names_what_is_wrong():
    mi.set_variant("llvm_ad_spectral")
    with pytest.raises(RuntimeError, match="did you mean dvd"):
        mi.load_dict({"type": "diffraction_preset", "preset": "dvdd"})
    with pytest.raises(RuntimeError, match="preset is missing"):
        mi.load_dict({"type": "diffraction_preset"})
    with pytest.raises(RuntimeError, match="'presets'; did you mean preset"):
        mi.load_dict({"type": "diffraction_preset", "presets": "dvd"})


SCENE = '<scene version="3.0.0"><shape type="sphere">{}</shape></scene>'


@pytest.fixture
def own_folder(some_variant: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_a_plugin_that_is_registered_in_python_loads(own_folder):
    class Own(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)

        def to_string(self):
            return "Own[]"

    mi.register_bsdf("own-bsdf_2", Own)
    scene = loaded(SCENE.format('<bsdf type="own-bsdf_2"/>'))
    assert isinstance(scene.shapes()[0].bsdf(), Own)


def test_memory_addresses_of_blender_are_refused(own_folder):
    vertices = '<integer name="verts" value="8"/>'
    with pytest.raises(DiffractionError, match="blender"):
        loaded(SCENE.replace("sphere", "blender").format(vertices))


def test_an_unknown_plugin_is_named(own_folder):
    with pytest.raises(DiffractionError, match="'difuse'"):
        loaded(SCENE.format('<bsdf type="difuse"/>'))


def test_optical_constants_are_mitsubas(some_variant, tmp_path):
    other_metals(tmp_path)
    _, index = tabulated_index("Al")
    with searched(tmp_path):
        np.testing.assert_array_equal(tabulated_index("Al")[1], index)
        for name in ("Unobtainium", "../ior/Al", "data/ior/Al"):
            with pytest.raises(DiffractionError, match="unknown"):
                Conductor.of_material(name, 550.0)


def test_conductors_of_a_scene_are_mitsubas(own_folder):
    scene = SCENE.format('<bsdf type="conductor"><string name="material" value="Al"/></bsdf>')
    alone = str(loaded(scene).shapes()[0].bsdf())
    other_metals(Path.cwd())
    assert str(loaded(scene).shapes()[0].bsdf()) == alone
