"""Commands look at their inputs before they open them: no pipe is waited for, no name crashes."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tests.support.inputs import COMMANDS, SLOW
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


#: Lines with files that heights are read from, however they are named, and a list of orders.
_MORE = [
    *(f"info {name}" for name in ("h", *(f"h.{suffix}" for suffix in _SUFFIXES))),
    *(f"{command} its.toml" for command in _OF_HEIGHTS), "brdf-map h", "evaluate h.exr",
    "solve h.csv --import --period 1", "hologram logo.png --mesh h.ply", "tangents h.gltf",
]  # fmt: skip


@posix
@pytest.mark.parametrize("line", [*(command for command, _ in COMMANDS + SLOW), *_MORE])
def test_a_pipe_is_refused_at_once(run, world, alarm, line):
    """The last of the files in the command's words is a pipe."""
    files = [word for word in line.replace("=", " ").split() if Path(word).suffix or word == "h"]
    name = "h.npy" if "its.toml" in line else [f for f in files if not f[0].isdigit()][-1]
    Path("its.toml").write_text('source = "h.npy"\n')
    Path(name).unlink(missing_ok=True)
    os.mkfifo(name)
    out = ["-o", "a.ply"] if line.startswith("tangents") else []
    *_, last = run(*line.split(), *out).err.splitlines()
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
