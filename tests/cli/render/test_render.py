"""`render`: a scene in, pictures out, and what they show; `tonemap`: the PNG of an EXR."""

from __future__ import annotations

import json
import os
import re
import shlex
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction.optics.display import shown
from tests.support.room import QUICK, SCENE, pixels, png


def test_an_exr_and_a_png_are_written_and_named(run, scene):
    ran = run("render", scene, *QUICK).succeeded()
    assert sorted(os.listdir()) == ["room.exr", "room.png", "room.xml"]
    assert ran.out.startswith("room.exr and room.png: 24 x 16 pixels, 4 samples per pixel, ")
    assert pixels("room.exr").shape == (16, 24, 3)
    assert pixels("room.exr").dtype == np.float32
    assert OpenEXR.File("room.exr").header()["spp"] == 4


def test_a_png_alone_can_be_asked_for(run, scene):
    assert run("render", scene, *QUICK, "-o", "a.png", "--json", "a.json").code == 0
    report = json.loads(Path("a.json").read_text(encoding="utf-8"))
    assert (report["files"], report["pixels"], report["spp"]) == (["a.png"], [24, 16], 4)
    assert sorted(os.listdir()) == ["a.json", "a.png", "room.xml"]


def test_seeds_repeat_and_differ(run, scene):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert run("render", scene, *QUICK, "-o", f"{name}.exr", "--seed", seed).code == 0
    # to single precision: the threads' blocks are added up in any order
    assert pixels("a.exr") == pytest.approx(pixels("b.exr"), rel=1e-5)
    assert pixels("a.exr") != pytest.approx(pixels("c.exr"), rel=1e-3)


def test_parameters_reach_the_scene(run, scene):
    ran = run("render", scene, *QUICK, "-D", "spp=2", "-D", "format=luminance", "-o", "a.exr")
    assert "2 samples per pixel" in ran.out
    assert list(OpenEXR.File("a.exr").channels()) == ["Y"]


@pytest.mark.parametrize(
    ("pixel_format", "mode"),
    [("rgba", "RGBA"), ("xyz", "RGB"), ("luminance", "L"), ("luminance_alpha", "LA")],
)
def test_films_of_every_format_give_a_png(run, scene, pixel_format, mode):
    assert run("render", scene, *QUICK, "-D", f"format={pixel_format}", "-o", "a.png").code == 0
    assert png("a.png")[1] == mode


def test_alpha_is_straight_in_the_png(run, scene):
    scene.write_text(SCENE.replace('<integrator type="path"/>', '<integrator type="path"><boolean '
                                   'name="hide_emitters" value="true"/></integrator>'))  # fmt: skip
    assert run("render", scene, *QUICK, "-D", "format=rgba", "-o", "a.exr", "-s", "16").code == 0
    linear, (shown, _) = pixels("a.exr"), png("a.png")
    assert shown[0, 0, 3] == 0
    edge = (linear[..., 3] > 0.3) & (linear[..., 3] < 0.9)
    assert edge.any()
    # the sphere is as bright at its half covered edge as inside: 0.5 · 0.5 in an sRGB byte
    assert np.abs(shown[edge][:, :3].astype(float) - 137).max() < 25


def test_films_without_colours_are_written_as_exr_only(run, scene):
    scene.write_text(
        SCENE.replace('type="hdrfilm"', 'type="specfilm"')
        .replace('<string name="pixel_format" value="$format"/>', '<spectrum name="band_a" '
                 'value="400:0, 500:1, 600:0"/>')
    )  # fmt: skip
    mode = ["-m", "scalar_spectral", "-s", "1"]
    ran = run("render", scene, *mode, "-o", "a.exr").succeeded()
    assert "only the EXR was written" in ran.err
    assert list(OpenEXR.File("a.exr").channels()) == ["band_a"]
    line = run("render", scene, *mode, "-o", "b.png").failed_in_one_line()
    assert "name an EXR: -o b.exr" in line
    assert sorted(os.listdir()) == ["a.exr", "room.xml"]


def test_further_channels_are_kept_in_the_exr(run, scene):
    scene.write_text(
        SCENE.replace(
            '<integrator type="path"/>',
            '<integrator type="aov"><string name="aovs" value="dd:depth"/>'
            '<integrator type="path"/></integrator>',
        )
    )
    assert run("render", scene, *QUICK, "-o", "a.exr").code == 0
    assert {"RGB", "dd.T"} <= set(OpenEXR.File("a.exr").channels())
    assert png("a.png")[1] == "RGB"


def test_pixels_that_are_not_numbers_are_counted(run, scene):
    scene.write_text(SCENE.replace('<rgb name="radiance" value="0.5"/>',
                                   '<spectrum name="radiance" value="nan"/>'))  # fmt: skip
    ran = run("render", scene, *QUICK, "-o", "a.exr", "-s", "1").succeeded()
    assert "pixels not finite" in ran.err


def test_a_sensor_is_chosen_by_its_number(run, scene):
    second = SCENE[SCENE.index("  <sensor") : SCENE.index("  <emitter")].replace('"24"', '"8"')
    scene.write_text(SCENE.replace("  <emitter", second + "  <emitter"))
    assert "8 x 16" in run("render", scene, *QUICK, "--sensor", "1", "-o", "a.png").out
    line = run("render", scene, *QUICK, "--sensor", "2").failed_in_one_line()
    assert "sensor 2: the scene has 2" in line


@pytest.fixture
def patch_scene(scene, heights, monkeypatch):
    """The room with the grating on its sphere; tables are cached in the same folder only."""
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(scene.parent / "cache"))
    scene.write_text(
        SCENE.replace(
            '<bsdf type="diffuse"/>',
            '<bsdf type="diffraction"><string name="filename" value="$patch"/>'
            '<float name="pixel_size" value="$pixel_size"/>'
            '<float name="coherence_width" value="6"/></bsdf>',
        ).replace(
            "  <integrator",
            f'<default name="patch" value="{heights}"/><default name="pixel_size" value="0.08"/>'
            "  <integrator",
            1,
        )
    )
    return scene


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("patch=nofile.npy", "'nofile.npy' does not exist"),
        ("pixel_size=0", "pixel_size"),
        ("pixel_size=-1", "pixel_size"),
    ],
)
def test_a_patch_that_does_not_fit_is_one_line(run, patch_scene, definition, said):
    line = run("render", patch_scene, "-m", "llvm_ad_spectral", "-D", definition)
    assert said in line.failed_in_one_line()
    assert "room.xml', line" in line.err


def test_doubts_about_a_patch_are_counted_and_info_has_them(run, patch_scene):
    ran = run(
        "render", patch_scene, "-m", "llvm_ad_spectral", "-s", "1", "-o", "a.png",
        "-D", "pixel_size=0.2",
    ).succeeded()  # fmt: skip
    (line,) = ran.err.splitlines()
    number, command = re.search(r"(\d+) notes? on .*: mitsuba-diffraction (.*)$", line).groups()
    described = json.loads(run(*shlex.split(command), "--json").out)
    assert len(described["warnings"]) == int(number) > 0
    assert sum("coarser than a quarter" in line for line in described["warnings"]) == 1


@pytest.mark.parametrize("line", ['<boolean name="second_order" value="true"/>',
                                  '<string name="layering" value="thesis"/>'])  # fmt: skip
def test_a_scene_that_names_a_retired_parameter_is_rendered(run, heights, here, line):
    name = line.split('"')[1]
    surface = f"""<bsdf type="diffraction">
      <string name="filename" value="{heights}"/><float name="coherence_width" value="6"/>
      <float name="pixel_size" value="0.08"/>
      <boolean name="energy_conserving" value="false"/>%s</bsdf>"""
    for file, parameter in (("old.xml", line), ("new.xml", "")):
        text = SCENE.replace('<bsdf type="diffuse"/>', surface % parameter)
        (here / file).write_text(text, encoding="utf-8")
        ran = run("render", file, *QUICK, "-s", "1", "-o", file.replace("xml", "exr")).succeeded()
        assert ran.err.count(f"{name} is no longer a parameter") == (file == "old.xml")
    # threads add the samples of a pixel in any order, in single precision
    np.testing.assert_allclose(pixels("old.exr"), pixels("new.exr"), rtol=1e-5)


def test_the_exr_has_a_channel_for_each_receptor_and_the_png_a_legend(run, scene):
    ran = run(
        "render", scene, "-m", "scalar_spectral", "-s", "16", "--observer", "dog", "-o", "a.exr"
    ).succeeded()
    assert "channels s, l" in ran.out
    channels = OpenEXR.File("a.exr").channels()
    assert set(channels) == {"s", "l"}
    # the room's light is white: daylight has less power at 429 nm than at 555 nm
    short, long = (float(np.mean(channels[name].pixels)) for name in ("s", "l"))
    assert 0.0 < short < long
    with Image.open("a.png") as picture:
        assert picture.width > 400


def write(name, **channels):
    """Write an EXR of these channels."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(name)


@pytest.fixture
def light():
    """Colours from black to far beyond white, some outside the gamut."""
    rng = np.random.default_rng(1)
    return (rng.normal(0.6, 0.6, (16, 24, 3)) * 4.0 ** rng.normal(0, 2, (16, 24, 1))).astype("f4")


@pytest.mark.parametrize("view", ["natural", "standard"])
def test_the_png_shows_the_view_and_the_exr_stays(run, here, light, view):
    write("a.exr", RGB=light)
    before = Path("a.exr").read_bytes()
    assert run("tonemap", "a.exr", "--tonemap", view, "--exposure", "-1").code == 0
    # Mitsuba dithers between the two neighbours
    assert np.abs(png("a.png")[0] - 255 * shown(light / 2, view)).max() < 1.01
    assert Path("a.exr").read_bytes() == before


def test_tonemap_writes_the_png_that_render_writes(run, scene):
    assert run("render", scene, *QUICK, "-o", "a.exr", "--exposure", "1").code == 0
    assert run("tonemap", "a.exr", "-o", "b.png", "--exposure", "1").code == 0
    assert np.abs(png("a.png")[0].astype(int) - png("b.png")[0]).max() <= 1  # dithered


def test_luminance_and_alpha_are_shown(run, here, light):
    write("a.exr", Y=np.ascontiguousarray(light[..., 0]), A=np.full(light.shape[:2], 0.5, "f4"))
    assert run("tonemap", "a.exr").code == 0
    picture, mode = png("a.png")
    assert mode == "LA"
    expected = shown(np.repeat(2 * light[..., :1], 3, axis=-1))[..., 0]  # alpha is premultiplied
    assert np.abs(picture[..., 0] - 255 * expected).max() < 1.01
