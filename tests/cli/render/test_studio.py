"""Options of `render` for a mesh in a few words: parameters of its stage."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.cli.main import build_parser
from mitsuba_diffraction.cli.scene_options import put_on_stage, scene_parameters
from mitsuba_diffraction.cli.studio import take_studio
from mitsuba_diffraction.scene.parameters import parameters_of
from mitsuba_diffraction.scene.stage import STUDIO
from tests.support import ROOT

MESH = ROOT / "scenes" / "meshes" / "knot.ply"  # which a wheel does not bring along


@pytest.fixture
def parameters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """`parameters(*options)`: values for the scene, and the options as `render` has them."""
    monkeypatch.chdir(tmp_path)
    mi.set_variant("llvm_ad_spectral")
    for name in ("scale.npy", "skin.png", "none.exr"):
        Path(name).write_bytes(b"x")
    mi.Bitmap(np.ones((2, 4, 3), np.float32)).write("sky.hdr")
    mi.Bitmap(np.ones((4, 4, 3), np.float32)).write("probe.hdr")
    mi.Bitmap(np.ones((2, 4, 3), np.uint8)).write("screen.png")

    def call(*options: str):
        args = build_parser().parse_args(["render", str(MESH), *options])
        take_studio(args)
        put_on_stage(args)
        values = scene_parameters(args)
        assert set(values) - {"material:surface", "render:clamp", "height_scale"} <= set(
            parameters_of(STUDIO, values)
        )
        return values, args

    return call


def test_a_panorama_and_a_sun_light_the_scene_outdoors(parameters):
    values, _ = parameters("--preset", "cd", "--env", "sky.hdr", "--sun", "120,40")
    assert Path(values["light"]).name == "outdoors.xml"
    assert Path(values["sky"]).name == "environment.xml"
    assert Path(values["environment"]).name == "sky.hdr"
    assert (values["sun_azimuth"], values["sun_elevation"]) == ("120", "40")
    assert float(values["sun_irradiance"]) > 0
    values, _ = parameters("--preset", "cd", "--sun=-30,10", "-D", "sun_elevation=12")
    assert Path(values["sky"]).name == "daylight.xml"
    assert values["sun_elevation"] == "12"  # -D goes before


@pytest.mark.parametrize(
    ("options", "others"),
    [
        (["--preset", "Body=cd"], "own"),
        (["--assign", "Body=scale.npy"], "own"),
        (["--preset", "cd", "--preset", "Body=dvd"], None),
        (["--patch", "scale.npy", "--preset", "Body=dvd"], None),
        (["--preset", "Body=cd", "-D", "others=surface"], "surface"),
    ],
)
def test_without_a_surface_of_the_whole_other_materials_are_the_file_s(parameters, options, others):
    args = build_parser().parse_args(["render", str(MESH), *options])
    put_on_stage(args)
    values = scene_parameters(args)
    assert values.get("others") == others
    assert "material:Body" in values


def test_two_surfaces_of_the_whole_are_refused_by_name(parameters, capsys):
    with pytest.raises(SystemExit):
        parameters("--patch", "scale.npy", "--preset", "cd")
    assert "two surfaces, --patch scale.npy and" in capsys.readouterr().err


def test_a_sky_over_a_label_comes_with_a_floor():
    label = STUDIO.with_name("label.xml")
    args = build_parser().parse_args(["render", str(label), "--sun", "120,40"])
    take_studio(args)
    values = dict(args.parameters)
    assert Path(values["light"]).name == "outdoors.xml"
    assert "floor" in (parameters_of(label, values) or {})


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--base", "gold"], {"material": "gold"}),
        (["--base", "sienna"], {"material": "keratin", "pigment": "sienna"}),
        (["--base", "skin.png"], {"material": "keratin", "pigment": "skin.png"}),
        (["--finish", "skin", "--base", "gold"], {"material": "keratin", "pigment": "gold"}),
        (["--finish", "coated"], {"material": "Al", "coat_ior": "1.5"}),
        (["--height-scale", "0.5", "--clamp", "20"], {"height_scale": "0.5", "render:clamp": "20"}),
    ],
)
def test_looks_are_parameters_of_the_surface(parameters, options, expected):
    values, _ = parameters("--patch", "scale.npy", *options)
    assert expected.items() <= values.items()


def test_an_orbit_turns_the_camera_around_a_mesh_framed_for_all_turns(parameters):
    values, args = parameters("--preset", "cd", "--orbit")
    assert values["frame"] == "turning"
    assert (args.frames, args.turn) == (24, ["camera_azimuth"])


@pytest.mark.parametrize(
    ("scene", "turned"), [("material_ball", "render:orbit"), ("label", "camera_azimuth")]
)
def test_any_scene_has_an_orbit(scene, turned):
    args = build_parser().parse_args(["render", str(STUDIO.with_name(f"{scene}.xml")), "--orbit"])
    take_studio(args)
    assert (args.frames, args.turn) == (24, [turned])


def test_parameters_of_the_surface_change_a_preset(parameters):
    values, _ = parameters("--preset", "snake", "-D", "pigment=0.3,0.2,0.1", "-D", "resx=8")
    assert values["material:surface"] == "preset:snake,pigment=0.3,0.2,0.1"
    assert values["resx"] == "8"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--finish", "metal", "--base", "sienna"], "--base 'sienna' is not a metal"),
        (["--env", "none.hdr"], "'none.hdr' does not exist"),
        (["--env", "none.exr"], "'none.exr' is not a panorama"),
        (["--env", "probe.hdr"], "twice as wide as high"),
        (["--env", "screen.png"], "a picture for screens"),
    ],
)
def test_what_does_not_fit_is_an_error(parameters, options, said):
    with pytest.raises(DiffractionError, match=said):
        parameters("--patch", "scale.npy", *options)


@pytest.mark.parametrize(
    "options", [["--preset", "cd", "--finish", "skin"], ["--preset", "cd", "--sun", "12"]]
)
def test_contradictions_are_usage_errors(parameters, options):
    with pytest.raises(SystemExit):
        parameters(*options)
