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
GRATING = f"grating.toml{SETTINGS}"
DISK = '<shape type="disk" id="disk"><ref id="skin"/></shape>'
METAL, PIGMENT = (
    skin(f'<string name="{name}" value="{value}"/>') + DISK
    for name, value in (("material", "Al"), ("pigment", "0.25"))
)
PLASTIC = '<bsdf type="plastic" id="below"/>'
MASKED = EXPORTED.replace('"twosided" id="mat-Skin"', '"mask" id="mat-Skin"')
ALIAS = f'{EXPORTED}<alias id="mat-Skin" as="hide"/>'
ABOVE, GROUND = "elm__0", "elm__4"


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """`load(elements, values, say)`: a scene of these elements with surfaces put on its ids."""
    mi.set_variant("llvm_ad_spectral")
    monkeypatch.chdir(tmp_path)
    thin_grating(0.6, counts=(2, 2, 1)).save("orders.nc")
    thin_grating(0.6, counts=(2, 2, 1), thin=True).save("sheet.nc")

    def call(elements, materials, values=(), **more):
        edits = {f"material:{name}": text for name, text in materials.items()} | dict(values)
        return load_scene(scene_file(tmp_path, elements), edits, **more)

    return call


#: Elements, surfaces by id; a shape, and what its BSDF has and lacks.
EDITS = {
    "a material": (EXPORTED, {"mat-Skin": GRATING}, ABOVE, "Diffraction[; Principled", ""),
    "a shape": (EXPORTED, {ABOVE: GRATING}, ABOVE, "Diffraction[; Principled", ""),
    "another shape": (EXPORTED, {ABOVE: GRATING}, GROUND, "Diffuse", "Diffraction["),
    "a metal": (EXPORTED, {ABOVE: f"{GRATING},material=Al"}, ABOVE, "Diffraction[", "Principled"),
    "an alias": (ALIAS, {"hide": GRATING}, ABOVE, "Diffraction[", ""),
    "a look": (EXPORTED, {ABOVE: "preset:dvd,orientation=20"}, ABOVE,
               "DiffractionOrders[; orientation = 20", ""),
    "opacity of a material": (MASKED, {"mat-Skin": GRATING}, ABOVE,
                              "Diffraction[; Principled", ""),
    "opacity of a shape": (MASKED, {ABOVE: GRATING}, ABOVE, "Diffraction[; Principled", ""),
    "orders over heights": (
        skin('<float name="orientation" value="30"/>') + DISK, {"skin": "orders.nc"}, "disk",
        "DiffractionOrders[; orientation = 30", "Diffraction[",
    ),
    # a metal beneath would look like chrome
    "skin over metal": (METAL, {"skin": f"{GRATING},int_ior=1.6"}, "disk", "Diffraction[",
                        "SmoothDiffuse; material = Al"),
    "skin over pigment": (PIGMENT, {"skin": f"{GRATING},int_ior=1.6"}, "disk",
                          "Diffraction[; SmoothDiffuse", ""),
    "beneath": (skin('<bsdf type="plastic" name="beneath"/>') + DISK, {"skin": GRATING}, "disk",
                "Diffraction[; Plastic", ""),
    "beneath by a reference": (PLASTIC + skin('<ref id="below" name="beneath"/>') + DISK,
                               {"skin": GRATING}, "disk", "Diffraction[; Plastic", ""),
}  # fmt: skip


@pytest.mark.parametrize(
    ("elements", "materials", "name", "has", "lacks"), EDITS.values(), ids=EDITS
)
def test_a_surface_is_put_on_its_id_alone_and_keeps_what_lies_around_it(
    load, elements, materials, name, has, lacks
):
    (shape,) = (shape for shape in load(elements, materials).shapes() if shape.id() == name)
    text = str(shape.bsdf())
    assert text.startswith("Mask[" if elements is MASKED else "TwoSided[")
    assert [part for part in has.split("; ") if part not in text] == []
    assert not lacks or [part for part in lacks.split("; ") if part in text] == []
    assert text.count("Diffraction[") in (0, text.count("brdf["))


@pytest.mark.parametrize("text", ["sheet.nc", f"{GRATING},thin=true,int_ior=1.5"])
def test_light_goes_through_a_sheet_that_replaces_a_material(load, text):
    (shape,) = load(f'<bsdf type="diffuse" id="skin"/>{DISK}', {"skin": text}).shapes()
    flags = shape.bsdf().flags()
    assert mi.has_flag(flags, mi.BSDFFlags.Transmission)
    assert not mi.has_flag(flags, mi.BSDFFlags.Diffuse)


@pytest.mark.parametrize(
    ("elements", "materials", "words"),
    [
        (EXPORTED, {"Pant": GRATING}, "'Pant'.*mat-Skin, mat-Ground, elm__0, elm__4"),
        (EXPORTED, {"mat-Skin": "preset:dvdd"}, "did you mean dvd"),
        (f'<bsdf type="diffuse" id="spare"/>{EXPORTED}', {"spare": GRATING},
         "no shape uses .*'spare'; .*mat-Skin, mat-Ground"),
        (EXPORTED, {"mat-Skin": GRATING, ABOVE: GRATING}, "no shape is left .*'mat-Skin', since"),
        (EXPORTED, {ABOVE: GRATING, "mat-Skin": GRATING}, "no shape is left .*'mat-Skin', since"),
        (ALIAS, {"hide": GRATING, "mat-Skin": GRATING}, "both ids are of one BSDF"),
    ],
)  # fmt: skip
def test_an_edit_that_acts_on_nothing_is_refused(load, elements, materials, words):
    with pytest.raises(DiffractionError, match=words) as refused:
        load(elements, materials)
    assert "material:" not in str(refused.value)


def test_each_edit_is_said_with_its_shapes_and_index(load):
    lines: list[str] = []
    load(
        EXPORTED, {"mat-Skin": f"{GRATING},int_ior=1.6"}, {"height_scale": "0.5"}, say=lines.append
    )
    assert lines[0].startswith("mat-Skin: grating.toml")
    assert lines[1].startswith("height_scale=0.5")
    assert all("on 1 shape (elm__0)" in line and "n = 1.6" in line for line in lines)


def test_a_parameter_that_only_a_replaced_surface_reads_is_refused(load):
    metal = {"skin": f"{GRATING},material=Al"}
    radius = '<default name="r" value="1"/>'
    ball = '<shape type="sphere"><float name="radius" value="$r"/><ref id="skin"/></shape>'
    load(radius + skin('<float name="lateral_scale" value="$r"/>') + ball, metal, {"r": "2"})
    stretched = radius + '<default name="up" value="0"/>'
    stretched += skin('<float name="lateral_scale" value="$up"/>')
    load(stretched + ball, metal, {"up": "0.0"})  # the default
    with pytest.raises(DiffractionError, match=r"up=2 changes nothing"):
        load(stretched + ball, metal, {"up": "2"})


def test_a_parameter_of_a_file_that_another_parameter_includes_is_accepted(load):
    Path("lit.xml").write_text(
        """<scene version="3.0.0"><default name="power" value="1"/>
        <emitter type="constant"><float name="radiance" value="$power"/></emitter></scene>"""
    )
    Path("dark.xml").write_text('<scene version="3.0.0"/>')
    light = '<default name="light" value="dark.xml"/><include filename="$light"/>'
    scene = f'<bsdf type="diffuse" id="skin"/>{DISK}{light}', {"skin": f"{GRATING},material=Al"}
    assert (
        len(load(*scene, {"light": str(Path("lit.xml").resolve()), "power": "2"}).emitters()) == 1
    )
    # the default in other words
    assert not load(*scene, {"light": str(Path("dark.xml").resolve())}).emitters()
