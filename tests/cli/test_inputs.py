"""Commands look at their inputs before they open them: no pipe is waited for, no name crashes."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tests.support.systems import posix

SCENE = """<scene version="3.0.0">
  <default name="width" value="8"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <film type="hdrfilm"><integer name="width" value="$width"/></film>
  </sensor>
  {}
</scene>
"""


_OF_HEIGHTS = (
    "precompute", "brdf-map", "spectrum", "evaluate", "scatter", "tradeoff", "survey",
    "export-shader", "export-osl", "export-bsdf",
)  # fmt: skip
_SUFFIXES = "png", "npy", "csv", "toml", "nc", "ply", "exr", "gltf", "tif", "spm"


@pytest.fixture
def alarm():
    """An alarm that fails the test if a command waits for somebody to write into a pipe."""

    def waits(*_: object) -> None:
        pytest.fail("it waits for somebody to write into the pipe")

    before = signal.signal(signal.SIGALRM, waits)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


_LOOK = "h.npy --pixel-size 0.1 --light 0"


@posix
@pytest.mark.parametrize(
    "line",
    [
        "info pipe", *(f"info pipe.{suffix}" for suffix in _SUFFIXES),
        *(f"{command} {file}" for command in _OF_HEIGHTS for file in ("pipe.npy", "its.toml")),
        "precompute pipe.toml", "brdf-map pipe", "evaluate pipe.exr", "sweep method pipe",
        "solve pipe.csv --import --period 1", "orders pipe.nc", "tonemap pipe.exr",
        "hologram pipe.png", "hologram logo.png --mesh pipe.ply", "tangents -o a.ply pipe.ply",
        "tangents -o a.ply pipe.gltf", "render -m scalar_rgb pipe.xml", "plan pipe.xml",
        "compare pipe.xml", "view pipe.xml", "export-viewer pipe.xml -o a.html",
        f"spectrum {_LOOK} --pigment pipe.csv", f"spectrum {_LOOK} --layers pipe.toml",
    ],
)  # fmt: skip
def test_a_pipe_is_refused_at_once(run, world, alarm, line):
    Path("its.toml").write_text('source = "pipe.npy"\n')
    for name in {"pipe.npy", *(word for word in line.split() if word.startswith("pipe"))}:
        os.mkfifo(name)
    *_, last = run(*line.split()).err.splitlines()
    assert "pipe or a device" in last


@posix
@pytest.mark.parametrize(
    "element",
    [
        '<shape type="ply"><string name="filename" value="pipe"/></shape>',
        '<include filename="pipe"/>',
        '<shape type="sphere"><bsdf type="diffraction">'
        '<string name="filename" value="pipe"/></bsdf></shape>',
    ],
    ids=["mesh", "include", "heights"],
)
def test_a_pipe_that_a_scene_names_is_refused_at_once(run, here, alarm, element):
    os.mkfifo("pipe")
    Path("a.xml").write_text(SCENE.format(element))
    ran = run("render", "a.xml", "-m", "scalar_rgb")
    assert "pipe or a device" in ran.failed_in_one_line()


@posix
def test_a_pipe_for_a_frame_or_a_table_of_treatments_is_refused_at_once(run, here, alarm, heights):
    Path("a.xml").write_text(SCENE.format(""))
    Path("frames").mkdir()
    os.mkfifo("frames/frame_0000.png")
    ran = run(
        "render", "a.xml", "--frames", 2, "--turn", "width", "-o", "frames", "-m", "scalar_rgb"
    )
    assert "pipe or a device" in ran.failed_in_one_line()
    os.mkfifo("pipe.toml")
    ran = run("survey", heights, "--treatments", "pipe.toml")
    assert "pipe or a device" in ran.failed_in_one_line()


def test_a_long_value_in_a_scene_is_not_taken_for_a_file(run, here):
    Path("a.xml").write_text(SCENE.format('<string name="note" value="' + 300 * "a" + '"/>'))
    ran = run("render", "a.xml", "-m", "scalar_rgb", "-s", 1)
    assert "File name too long" not in ran.err


@pytest.mark.parametrize("command", ["render", "info", "precompute", "brdf-map", "survey"])
def test_a_name_that_is_no_utf_8_is_refused_in_one_line(run, here, command):
    name = os.fsdecode(b"caf\xe9.xml")
    Path(name).write_text(SCENE.format(""))
    line = run(command, name).failed_in_one_line()
    assert "caf" in line
    assert "UTF-8" in line


MISSPELT = """<shape type="sphere"><bsdf type="twosided">
  <bsdf type="diffraction"><float name="int_iorr" value="1.5"/></bsdf>
</bsdf></shape>"""


@pytest.mark.parametrize(
    "command",
    ["render {} -m scalar_rgb", "render {} -m llvm_ad_rgb", "plan {}", "compare {}",
     "export-viewer {} -o a.html"],
)  # fmt: skip
def test_a_misspelt_parameter_of_a_scene_is_one_line(run, here, command):
    Path("a.xml").write_text(SCENE.format(MISSPELT))
    line = run(*command.format("a.xml").split()).failed_in_one_line()
    assert "'a.xml', line" in line
    assert "'int_iorr'; did you mean int_ior?" in line
    assert "Traceback" not in line
    assert "instantiate" not in line
