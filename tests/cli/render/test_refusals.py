"""`render` of what does not fit: one line, and nothing half-written."""

from __future__ import annotations

import os
import re

import pytest

from mitsuba_diffraction.cli.main import build_parser
from tests.support.room import QUICK, SCENE
from tests.support.systems import posix


def mesh(name):
    return SCENE.replace('type="sphere">', f'type="ply"><string name="filename" value="{name}"/>')


@pytest.mark.parametrize(
    ("text", "said"),
    [
        *((text, "room.xml") for text in (None, "", "no scene", '<scene version="3.5.0">')),
        (SCENE.replace("$spp", "$samples"), "undefined parameter: $samples"),
        (SCENE.replace('"diffuse"', '"velvet"'), "there is no bsdf plugin 'velvet'"),
        (SCENE.replace('"sphere"', '"ply"'), "shape 'ply'"),
        (SCENE.replace("$spp", "some"), "could not parse"),
        (SCENE.replace('"path"/>', '"path"><float name="depth" value="1"/></integrator>'),
         "no such parameter"),
        (mesh("a.obj"), "a.obj -o mesh.ply' first"),
        (mesh("a.stl"), "a.stl' is not a PLY, which is expected: convert it"),
        (mesh("a.ply"), "/a.ply' is a damaged PLY"),
    ],
)  # fmt: skip
def test_what_is_no_scene_is_one_line(run, scene, text, said):
    for name, content in (
        ("obj", "# of a modeller\nv 0 0 0\n"),
        ("stl", "solid\n"),
        ("ply", "ply\n"),
    ):
        (scene.parent / f"a.{name}").write_text(content)
    scene.write_text(text) if text is not None else scene.unlink()
    before = os.listdir()
    assert said in run("render", scene, *QUICK).failed_in_one_line()
    assert os.listdir() == before


def test_the_output_is_checked_before_the_scene_is_loaded(run, scene, monkeypatch):
    load = "mitsuba_diffraction.cli.render.load_scene"
    monkeypatch.setattr(load, lambda *_, **__: pytest.fail("loaded"))
    (scene.parent / "a.png").mkdir()
    for output, said in (("a.exr", "'a.png': it is a folder"), ("no/a.exr", "write 'no/a.exr'")):
        assert said in run("render", scene, *QUICK, "-o", output).failed_in_one_line()


@posix
@pytest.mark.parametrize("output", ["a.exr", "a.png"])
def test_a_full_disk_is_one_line_and_leaves_nothing(run, scene, output):
    from resource import RLIMIT_FSIZE, getrlimit, setrlimit

    scene.write_text(SCENE.replace('"24"', '"200"'))
    soft, hard = getrlimit(RLIMIT_FSIZE)
    setrlimit(RLIMIT_FSIZE, (1000, hard))  # what a full disk is like, without one
    try:
        ran = run("render", scene, *QUICK, "-s", "1", "-o", output)
    finally:
        setrlimit(RLIMIT_FSIZE, (soft, hard))
    assert f"cannot write '{output}': File too large" in ran.failed_in_one_line()
    assert os.listdir() == ["room.xml"]


def test_definitions_may_hold_equal_signs():
    args = build_parser().parse_args(["render", "a", "-D", "a=b=c", "-D", "d="])
    assert args.parameters == [("a", "b=c"), ("d", "")]


@pytest.mark.parametrize("names", [("width", "height"), ("crop_width", "crop_height")])
def test_a_picture_beyond_the_memory_is_refused_before_anything_is_loaded(run, scene, names):
    """Among the scene's objects is one that cannot be loaded; the film is refused first."""
    size = "".join(f'<integer name="{name}" value="$resx"/>' for name in names)
    text = re.sub(r'<integer name="(width|height)" value="[^"]*"/>', "", SCENE)
    text = text.replace('<film type="hdrfilm">', f'<film type="hdrfilm">{size}')
    text = re.sub("(<scene [^>]*>)", r'\1<default name="resx" value="9"/>', text)
    scene.write_text(text.replace("</scene>", '<shape type="no"/></scene>'))
    line = run("render", scene, *QUICK, "-D", "resx=99999999").failed_in_one_line()
    assert "99999999 x 99999999 pixels" in line
    assert "use fewer pixels" in line
    assert "there is no shape plugin 'no'" in run("render", scene, *QUICK).failed_in_one_line()
