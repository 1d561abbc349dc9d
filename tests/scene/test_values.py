"""Values of a scene's surfaces, camera and samples, beside the scene's own parameters."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.load import load_scene
from mitsuba_diffraction.scene.orbit import vertical
from mitsuba_diffraction.scene.parameters import CLAMP
from tests.support.room import scene_file, skin

METAL = skin('<string name="material" value="$material"/>')
DEFAULTS = """<default name="lamp" value="1"/><default name="sky" value="1"/>
    <default name="material" value="Al"/>"""
LIGHTS = """
    <shape type="rectangle" id="lamp"><emitter type="area">
        <spectrum name="radiance" type="d65"><float name="scale" value="$lamp"/></spectrum>
    </emitter></shape>
    <emitter type="constant">
        <spectrum name="radiance" type="d65"><float name="scale" value="$sky"/></spectrum>
    </emitter>"""
BALL = '<shape type="sphere"><bsdf type="twosided">{}</bsdf></shape>'


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    mi.set_variant("llvm_ad_spectral")
    return scene_file(tmp_path, DEFAULTS, BALL.format(METAL), LIGHTS)


def test_parameters_of_the_surface_reach_it(scene):
    loaded = load_scene(scene, {"height_scale": "0.5", "int_ior": "1.6"})
    text = str(loaded.shapes()[0].bsdf())
    assert "height_scale = 0.5" in text
    assert "Al" not in text  # an index replaces the material


def test_the_scenes_own_parameter_goes_first(scene):
    assert "Au" in str(load_scene(scene, {"material": "Au"}).shapes()[0].bsdf())


def test_a_scene_without_the_surface_refuses_its_parameters(scene):
    scene_file(scene.parent, DEFAULTS, BALL.format('<bsdf type="diffuse"/>'), LIGHTS)
    with pytest.raises(DiffractionError, match="as a material or a preset"):
        load_scene(scene, {"height_scale": "0.5"})


@pytest.mark.parametrize(("off", "left"), [("lamp", "Constant"), ("sky", "Area")])
def test_a_light_of_radiance_0_is_off(scene, off, left):
    loaded = load_scene(scene, {off: "0"})
    (emitter,) = loaded.emitters()
    assert left in emitter.class_name()
    assert len(loaded.shapes()) == 2


CAMERA = """
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="4,-9,2" target="4,0,2" up="0,0,1"/></transform>
  </sensor>
  <shape type="sphere"><point name="center" x="4" y="1" z="2"/><bsdf type="diffuse"/></shape>
"""


def test_a_camera_goes_around_the_middle_of_the_shapes(tmp_path: Path) -> None:
    mi.set_variant("scalar_rgb")
    file = scene_file(tmp_path, CAMERA)

    def pose(degrees: float) -> np.ndarray:
        scene = load_scene(file, {"render:orbit": str(degrees)})
        return np.array(scene.sensors()[0].world_transform().matrix)

    # 10 in front of the middle (4, 1, 2), then 10 to its right, still looking at it
    assert pose(0)[:3, 3] == pytest.approx([4, -9, 2], abs=1e-5)
    assert pose(90)[:3, 3] == pytest.approx([14, 1, 2], abs=1e-5)
    assert pose(90)[:3, 2] == pytest.approx([-1, 0, 0], abs=1e-6)
    assert pose(90)[:3, 1] == pytest.approx([0, 0, 1], abs=1e-6)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("elevation", [-20, 0, 45, 60])
def test_the_vertical_is_the_axis_that_points_upwards_in_the_picture(
    axis: int, elevation: float
) -> None:
    up, ahead = np.eye(3)[axis], np.eye(3)[axis - 1]
    sin, cos = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    assert vertical(cos * up + sin * ahead, cos * ahead - sin * up) == pytest.approx(up)


# Two halves of a wall that shine: 0.5 on the left, 4 on the right. 8 pixels see their 4 m; above
# and below the left half is darkness.
WALL = """<scene version="3.0.0">
    <integrator type="{integrator}"/>
    <sensor type="perspective"><float name="fov" value="53.130102"/>
        <transform name="to_world"><translate z="-4"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="4"/>
            <rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/>
        <translate x="1"/><scale y="0.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="0.5"/></emitter></shape>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/>
        <translate x="-1"/></transform>
        <emitter type="area"><rgb name="radiance" value="4, 2, 1"/></emitter></shape>
</scene>"""


@pytest.fixture(params=["llvm_ad_rgb", "scalar_rgb"])
def wall(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    mi.set_variant(request.param)
    (tmp_path / "scene.xml").write_text(WALL.format(integrator="path"))
    return tmp_path / "scene.xml"


def test_bright_samples_keep_their_colour_and_others_are_as_they_were(wall):
    whole, limited = (
        np.array(mi.render(load_scene(wall, values), seed=0)) for values in ({}, {CLAMP: "2"})
    )
    bright = whole.max(axis=-1) > 2
    assert 0 < bright.sum() < bright.size
    assert (whole == 0).any()
    assert limited[~bright] == pytest.approx(whole[~bright])
    assert limited[bright] == pytest.approx(whole[bright] / 2)  # 4, 2, 1 becomes 2, 1, 0.5


@pytest.mark.parametrize("name", ["config", "filename"])
def test_names_that_mitsuba_takes_for_itself_are_refused(name, tmp_path):
    mi.set_variant("scalar_rgb")
    file = scene_file(tmp_path, f'<default name="{name}" value="1"/>')
    with pytest.raises(DiffractionError, match=f"'{name}': Mitsuba reserves this name"):
        load_scene(file, {name: "2"})


def test_paths_from_lamps_are_refused(wall):
    wall.write_text(WALL.format(integrator="ptracer"))
    with pytest.raises(DiffractionError, match="leave clamping out"):
        load_scene(wall, {CLAMP: "2"})
