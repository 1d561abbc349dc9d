"""Surfaces put on ids of a scene that mitsuba-blender exported."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.load import load_scene
from tests.support.orders import thin_grating
from tests.support.room import scene_file, skin

EXPORTED = """
	<bsdf type="twosided" id="mat-Skin" name="mat-Skin">
		<bsdf type="principled" name="bsdf"><rgb name="base_color" value="0.3 0.1 0.1"/></bsdf>
	</bsdf>
	<bsdf type="twosided" id="mat-Ground" name="mat-Ground">
		<bsdf type="diffuse" name="bsdf"/>
	</bsdf>
	<shape type="sphere" id="elm__0" name="elm__0"><ref id="mat-Skin" name="bsdf"/></shape>
	<shape type="rectangle" id="elm__4" name="elm__4"><ref id="mat-Ground" name="bsdf"/></shape>
"""
SETTINGS = ",coherence_width=4,energy_conserving=false"
DISK = '<shape type="disk"><ref id="skin"/></shape>'


@pytest.fixture
def surface(tmp_path: Path) -> Path:
    mi.set_variant("llvm_ad_spectral")
    scene_file(tmp_path, EXPORTED)
    return tmp_path


def bsdfs(folder: Path, materials: dict[str, str]) -> dict[str, str]:
    """Text of each shape's BSDF, by id."""
    values = {f"material:{k}": f"{folder / 'grating.toml'}{v}" for k, v in materials.items()}
    scene = load_scene(folder / "scene.xml", values)
    return {shape.id(): str(shape.bsdf()) for shape in scene.shapes()}


@pytest.mark.parametrize("name", ["mat-Skin", "elm__0"])
def test_a_surface_is_put_on_the_id_alone_over_what_is_there(surface, name):
    texts = bsdfs(surface, {name: SETTINGS})
    assert "Diffraction[" in texts["elm__0"]
    assert "Principled" in texts["elm__0"]
    assert texts["elm__0"].startswith("TwoSided[")
    assert "Diffraction[" not in texts["elm__4"]


def test_a_metal_replaces_what_is_there(surface):
    texts = bsdfs(surface, {"mat-Skin": SETTINGS + ",material=Al", "elm__4": SETTINGS})
    assert "Principled" not in texts["elm__0"]
    assert "Diffuse" in texts["elm__4"]


def test_unknown_ids_are_answered_as_typed_with_those_of_the_scene(surface):
    with pytest.raises(DiffractionError, match="mat-Skin, mat-Ground, elm__0, elm__4") as refused:
        bsdfs(surface, {"Pant": SETTINGS})
    assert "'Pant'" in str(refused.value)
    assert "material:" not in str(refused.value)


def test_a_table_of_orders_keeps_the_orientation_of_what_it_replaces(surface):
    thin_grating(0.6, counts=(2, 2, 1)).save(surface / "orders.nc")
    scene = scene_file(surface, skin('<float name="orientation" value="30"/>'), DISK)
    loaded = load_scene(scene, {"material:skin": str(surface / "orders.nc")})
    text = str(loaded.shapes()[0].bsdf())
    assert "DiffractionOrders[" in text
    assert "orientation = 30" in text
    assert "Diffraction[" not in text


@pytest.mark.parametrize("thin", [True, False], ids=["table", "heights"])
def test_light_goes_through_a_sheet_that_replaces_a_material(surface, thin):
    thin_grating(0.6, counts=(2, 2, 1), thin=True).save(surface / "sheet.nc")
    scene = scene_file(surface, '<bsdf type="diffuse" id="skin"/>', DISK)
    heights = f"{surface / 'grating.toml'}{SETTINGS},thin=true,int_ior=1.5"
    text = str(surface / "sheet.nc") if thin else heights
    loaded = load_scene(scene, {"material:skin": text})
    flags = loaded.shapes()[0].bsdf().flags()
    assert mi.has_flag(flags, mi.BSDFFlags.Transmission)
    assert not mi.has_flag(flags, mi.BSDFFlags.Diffuse)


def test_a_look_is_put_on_an_id(surface):
    scene = load_scene(surface / "scene.xml", {"material:mat-Skin": "preset:dvd,orientation=20"})
    text = str(scene.shapes()[0].bsdf())
    assert text.startswith("TwoSided[")
    assert "DiffractionOrders[" in text
    assert "orientation = 20" in text
    with pytest.raises(DiffractionError, match="did you mean dvd"):
        load_scene(surface / "scene.xml", {"material:mat-Skin": "preset:dvdd"})


@pytest.mark.parametrize("old", ["material=Al", "pigment=0.25"])
def test_skin_in_place_of_a_diffracting_surface_lies_over_its_pigment_alone(surface, old):
    name, value = old.split("=")
    scene_file(surface, skin(f'<string name="{name}" value="{value}"/>'), DISK)
    text = bsdfs(surface, {"skin": SETTINGS + ",int_ior=1.6"}).popitem()[1]
    # a metal beneath would look like chrome
    assert text.count("Diffraction[") == text.count("brdf[")
    assert ("SmoothDiffuse" in text) == (name == "pigment")
    assert "material = Al" not in text


def test_a_bsdf_that_no_shape_uses_is_refused_with_those_in_use(surface):
    scene_file(surface, '<bsdf type="diffuse" id="spare"/>', EXPORTED)
    with pytest.raises(DiffractionError, match=r"no shape uses .*'spare'; .*mat-Skin, mat-Ground"):
        bsdfs(surface, {"spare": SETTINGS})


@pytest.mark.parametrize("part", ['<bsdf type="plastic"', '<ref id="below"'])
def test_what_lies_beneath_a_replaced_surface_is_kept(surface, part):
    scene_file(surface, '<bsdf type="plastic" id="below"/>', skin(f'{part} name="beneath"/>'), DISK)
    text = bsdfs(surface, {"skin": SETTINGS}).popitem()[1]
    assert "Plastic" in text
    assert text.count("Diffraction[") == 2  # on both sides


@pytest.mark.parametrize("order", [1, -1])
def test_a_surface_that_another_one_hides_is_refused(surface, order):
    both = {"mat-Skin": SETTINGS, "elm__0": SETTINGS}
    with pytest.raises(DiffractionError, match=r"no shape is left .*'mat-Skin', since elm__0"):
        bsdfs(surface, dict([*both.items()][::order]))


def test_two_ids_of_one_bsdf_get_one_surface(surface):
    scene_file(surface, EXPORTED, '<alias id="mat-Skin" as="hide"/>')
    assert "Diffraction[" in bsdfs(surface, {"hide": SETTINGS})["elm__0"]
    with pytest.raises(DiffractionError, match="both ids are of one BSDF"):
        bsdfs(surface, {"hide": SETTINGS, "mat-Skin": SETTINGS})


@pytest.mark.parametrize("name", ["mat-Skin", "elm__0"])
def test_the_opacity_around_a_replaced_bsdf_is_kept(surface, name):
    scene_file(surface, EXPORTED.replace('"twosided" id="mat-Skin"', '"mask" id="mat-Skin"'))
    text = bsdfs(surface, {name: SETTINGS})["elm__0"]
    assert text.startswith("Mask[")
    assert "Diffraction[" in text
    assert "Principled" in text


def test_each_edit_is_said_with_its_shapes_and_index(surface):
    lines: list[str] = []
    values = {
        "material:mat-Skin": f"{surface / 'grating.toml'}{SETTINGS},int_ior=1.6",
        "height_scale": "0.5",
    }
    load_scene(surface / "scene.xml", values, say=lines.append)
    assert lines[0].startswith("mat-Skin: grating.toml")
    assert lines[1].startswith("height_scale=0.5")
    assert all("on 1 shape (elm__0)" in line and "n = 1.6" in line for line in lines)


def test_a_parameter_that_only_a_replaced_surface_reads_is_refused(surface):
    metal = f"{surface / 'grating.toml'}{SETTINGS},material=Al"
    radius = '<default name="r" value="1"/>'
    ball = '<shape type="sphere"><float name="radius" value="$r"/><ref id="skin"/></shape>'
    scene = scene_file(surface, radius, skin('<float name="lateral_scale" value="$r"/>'), ball)
    load_scene(scene, {"material:skin": metal, "r": "2"})  # of the sphere
    stretched = skin('<float name="lateral_scale" value="$up"/>')
    scene_file(surface, radius, '<default name="up" value="0"/>', stretched, ball)
    load_scene(scene, {"material:skin": metal, "up": "0.0"})  # the default
    with pytest.raises(DiffractionError, match=r"up=2 changes nothing"):
        load_scene(scene, {"material:skin": metal, "up": "2"})


def test_a_parameter_of_a_file_that_another_parameter_includes_is_accepted(surface):
    (surface / "lit.xml").write_text(
        """<scene version="3.0.0"><default name="power" value="1"/>
        <emitter type="constant"><float name="radiance" value="$power"/></emitter></scene>"""
    )
    (surface / "dark.xml").write_text('<scene version="3.0.0"/>')
    light = '<default name="light" value="dark.xml"/><include filename="$light"/>'
    scene = scene_file(surface, '<bsdf type="diffuse" id="skin"/>', DISK, light)
    metal = f"{surface / 'grating.toml'}{SETTINGS},material=Al"
    values = {"material:skin": metal, "light": str(surface / "lit.xml"), "power": "2"}
    assert len(load_scene(scene, values).emitters()) == 1
    # the default in other words
    values = {"material:skin": metal, "light": str(surface / "dark.xml")}
    assert not load_scene(scene, values).emitters()
