"""Outputs never replace a file that the command reads: a given name is refused, a default changed.

`world` is a folder of small inputs.
"""

from __future__ import annotations

import itertools
import os
import shlex
import shutil
from pathlib import Path

import pytest

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.cli.arguments import OUTPUTS
from mitsuba_diffraction.cli.main import build_parser
from tests.support.inputs import HEIGHTS, PLY, RENDER
from tests.support.systems import posix


def _contents(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {f.name: (f.stat().st_ino, f.read_bytes()) for f in folder.iterdir() if f.is_file()}


@pytest.mark.parametrize(
    "command",
    [
        f"{RENDER} -o scale.png", f"{RENDER} -o scale.exr", f"{RENDER} -o sky.exr",
        f"{RENDER} -o ../here/sky.exr", f"{RENDER} --frames 2 --turn width -o frames",
        f"{RENDER} --assign ball=t.exr -o t.exr",
        f"{RENDER} --preset ball=cd,pigment=sky.exr -o sky.exr",
        "brdf-map recipe.toml -o h.exr", "evaluate recipe.toml -o h.png",
        "spectrum recipe.toml -o pigment.csv --pigment pigment.csv",
        f"spectrum h.npy {HEIGHTS} -o h.csv",
        "plan scale.xml -o recipe.toml", "tangents mesh.ply -o mesh.ply",
        "precompute recipe.toml -o h.exr", f"precompute t.exr {HEIGHTS} -o t.exr",
        "solve profile.txt --period 0.6 -o profile.nc", "orders orders.nc -o orders.csv",
        "tonemap sky.exr -o sky.png", f"export-bsdf h.npy {HEIGHTS} -o h.bsdf",
        f"export-shader h.npy {HEIGHTS} -o folder",
        f"export-osl h.npy {HEIGHTS} -o folder --name a",
        "export-viewer scale.xml -o page.html -m scalar_rgb", "compare scale.xml -o folder",
        "view scale.xml -o page.html -m scalar_rgb",
        "hologram logo.png -o folder", f"survey h.npy {HEIGHTS} -o folder",
        f"sweep method h.npy {HEIGHTS} -o h.png", "tradeoff h.npy --pixel-size 0.1 -o folder",
    ],
)  # fmt: skip
def test_a_given_output_over_an_input_is_refused_before_the_work(run, world, command):
    """Where the output's name is not an input's, the input is a link of that name."""
    beside = {
        "scale.exr": "t.exr", "h.exr": "h.npy", "h.png": "h.npy", "h.csv": "h.npy",
        "profile.nc": "profile.txt", "orders.csv": "orders.nc", "sky.png": "sky.exr",
        "h.bsdf": "h.npy", "page.html": "sky.exr",
        "frames/frame_0001.png": "scale.png", "folder/diffraction.glsl": "h.npy",
        "folder/a.osl": "h.npy", "folder/compare.json": "sky.exr", "folder/ring.xml": "logo.png",
        "folder/samples.csv": "h.npy", "folder/depth.png": "h.npy",
    }  # fmt: skip
    for name, source in beside.items():
        if name.split("/")[0] in command and not Path(name).exists():
            Path(name).parent.mkdir(exist_ok=True)
            os.link(source, name)
    before = _contents(world)
    assert "would overwrite" in run(*shlex.split(command)).failed_in_one_line()
    assert _contents(world) == before


def test_a_default_output_over_an_input_gets_another_name_in_one_line(run, world):
    """The scene reads scale.png, which is where its picture would go."""
    before = _contents(world)
    ran = run(*shlex.split(RENDER)).succeeded()
    said = [line for line in ran.err.splitlines() if "reads" in line]
    assert said == [
        "mitsuba-diffraction: this command reads 'scale.png', so its output is called 'scale-2.exr'"
    ]
    after = _contents(world)
    assert {"scale-2.exr", "scale-2.png"} == {*after} - {*before}
    assert all(after[name] == content for name, content in before.items())


@pytest.mark.parametrize(
    "command",
    ["survey scans -o scans", "survey scans -o .", "spectrum scans -o scans/a.csv",
     "spectrum ../here/scans -o scans/a.csv"],
)  # fmt: skip
def test_an_output_among_scans_that_a_second_run_would_read_is_refused(run, world, command):
    """A survey's folder has a folder `scans` of its own."""
    Path("scans").mkdir()
    shutil.copy("h.npy", "scans")
    assert "choose another folder" in run(*shlex.split(command)).failed_in_one_line()
    assert os.listdir("scans") == ["h.npy"]


def test_a_survey_goes_on_in_its_folder_that_the_shell_names_among_the_scans(run, world):
    """As `survey *` does the second time."""
    for _ in range(2):
        names = [name for name in sorted(os.listdir()) if name in ("h.npy", "survey")]
        ran = run("survey", *names, *shlex.split(HEIGHTS), "--resolution", "8").succeeded()
    assert "survey/survey.csv" in ran.err


@posix
@pytest.mark.parametrize("link", [os.link, os.symlink], ids=["hard", "symbolic"])
def test_links_to_an_input_are_that_input(run, world, link):
    link(world / "mesh.ply", world / "other.ply")
    for pair in itertools.permutations(["mesh.ply", "other.ply"]):
        line = run("tangents", pair[0], "-o", pair[1]).failed_in_one_line()
        assert "would overwrite" in line
    assert (world / "mesh.ply").read_text() == PLY


@posix
@pytest.mark.parametrize("name", ["pipe.png", "null.png"])
def test_a_pipe_or_a_device_as_output_is_refused(run, world, name):
    os.mkfifo("pipe.png")
    os.symlink(os.devnull, "null.png")
    line = run(*shlex.split(RENDER), "-o", name).failed_in_one_line()
    assert "pipe or a device" in line
    assert Path(name).exists()


def test_the_library_may_replace_what_it_has_read(world):
    before = Path("t.exr").read_bytes()
    DiffractionTable.load("t.exr").save("t.exr")
    assert Path("t.exr").read_bytes() == before


def test_every_option_that_names_an_output_is_known():
    """An output that counted as an input would be refused the second time."""
    parsers = next(a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    assert isinstance(parsers, dict)
    named = {
        action.dest for parser in parsers.values() for action in parser._actions
        if str(action.help).startswith("write") and action.metavar
    }  # fmt: skip
    assert named <= {*OUTPUTS}
