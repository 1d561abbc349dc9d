"""Values for a scene that are not parameters of its own: of its surfaces; and lights turned off."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.load import load_scene

SCENE = """<scene version="3.0.0">
    <default name="lamp" value="1"/><default name="sky" value="1"/>
    <default name="material" value="Al"/>
    <shape type="sphere"><bsdf type="twosided"><bsdf type="diffraction" id="skin">
        <string name="filename" value="grating.npy"/>
        <float name="pixel_size" value="0.08"/><float name="coherence_width" value="4"/>
        <boolean name="energy_conserving" value="false"/><string name="material" value="$material"/>
    </bsdf></bsdf></shape>
    <shape type="rectangle" id="lamp"><emitter type="area">
        <spectrum name="radiance" type="d65"><float name="scale" value="$lamp"/></spectrum>
    </emitter></shape>
    <emitter type="constant">
        <spectrum name="radiance" type="d65"><float name="scale" value="$sky"/></spectrum>
    </emitter>
</scene>"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    mi.set_variant("llvm_ad_spectral")
    np.save(tmp_path / "grating.npy", np.tile(0.05 * np.sin(np.arange(64) * np.pi / 8), (64, 1)))
    (tmp_path / "scene.xml").write_text(SCENE)
    return tmp_path / "scene.xml"


def test_parameters_of_the_surface_reach_it(scene):
    loaded = load_scene(scene, {"height_scale": "0.5", "int_ior": "1.6"})
    text = str(loaded.shapes()[0].bsdf())
    assert "height_scale = 0.5" in text
    assert "Al" not in text  # an index replaces the material


def test_the_scenes_own_parameter_goes_first(scene):
    assert "Au" in str(load_scene(scene, {"material": "Au"}).shapes()[0].bsdf())


def test_a_scene_without_the_surface_refuses_its_parameters(scene):
    scene.write_text(SCENE.replace('"diffraction"', '"diffuse"').split("<string")[0] +
                     SCENE[SCENE.index("</bsdf>"):])  # fmt: skip
    with pytest.raises(DiffractionError, match="as a material or a preset"):
        load_scene(scene, {"height_scale": "0.5"})
    with pytest.raises(DiffractionError, match="did you mean lamp"):
        load_scene(scene, {"lamq": "0.5"})


@pytest.mark.parametrize(("off", "left"), [("lamp", "Constant"), ("sky", "Area")])
def test_a_light_of_radiance_0_is_off(scene, off, left):
    loaded = load_scene(scene, {off: "0"})
    (emitter,) = loaded.emitters()
    assert left in emitter.class_name()
    assert len(loaded.shapes()) == 2
