"""Outputs never replace a file that the command reads: a given name is refused, a default changed.

`world` is a folder of small inputs.
"""

from __future__ import annotations

import itertools
import os
import shlex
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.cli.arguments import OUTPUTS
from mitsuba_diffraction.cli.main import build_parser
from tests.support.inputs import COMMANDS, HEIGHTS, NONE, PLY, RENDER, SLOW, inputs_of
from tests.support.systems import posix


def _contents(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {f.name: (f.stat().st_ino, f.read_bytes()) for f in folder.iterdir() if f.is_file()}


@pytest.mark.parametrize(
    ("command", "first", "output"),
    [(words, all_.split()[0], one) for words, all_ in COMMANDS + SLOW for one in all_.split()],
    ids=lambda text: text[:40],
)
def test_a_given_output_over_an_input_is_refused_before_the_work(
    run, world, command, first, output
):
    """The output is a link to the last of the files that the command reads, by way of others."""
    out, made = f"out{first}", f"out{output}"
    if not output.startswith("."):
        out, made = "out", f"out/{output}"
    Path(made).parent.mkdir(exist_ok=True)
    os.link(inputs_of(command, world)[-1], made)
    before = _contents(world)
    line = run(*shlex.split(command), "-o", out).failed_in_one_line()
    assert "would overwrite" in line
    assert _contents(world) == before


@pytest.mark.thorough
@pytest.mark.parametrize(("command", "outputs"), COMMANDS, ids=lambda text: text[:40])
def test_no_output_of_any_name_replaces_an_input(
    run, original, world, command, outputs, monkeypatch
):
    """Outputs called after each input, with every suffix, in several spellings; then defaults."""
    # a process for each `solve` would take longer to start than to solve
    monkeypatch.setattr("mitsuba_diffraction.orders.solve.jobs.processes", ThreadPoolExecutor)
    first, *_ = inputs = inputs_of(command, world)
    before = {name: (original / name).read_bytes() for name in inputs}

    def check(*options: str) -> list[str]:
        """Run the command, check its inputs, and tidy up; the names of what it has made."""
        run(*shlex.split(command), *options)
        assert {name: (world / name).read_bytes() for name in inputs} == before, options
        made = [str(f.relative_to(world)) for f in world.rglob("*") if f.is_file()]
        shutil.rmtree(world)
        shutil.copytree(original, world)
        os.chdir(world)
        return [name for name in made if not (world / name).exists()]

    spellings = itertools.cycle(["{}", "../here/./{}"])
    suffixes = [output for output in outputs.split() if output.startswith(".")]
    for name, suffix in itertools.product(sorted(inputs), suffixes):
        check("-o", next(spellings).format(f"{Path(name).stem}{suffix}"))
    for name in sorted(inputs):
        check("--json", next(spellings).format(name))
    # what the command makes by default are links to an input in the next run
    made = check()
    for name, link in zip(made, itertools.cycle([os.link, os.symlink]), strict=False):
        (world / name).parent.mkdir(parents=True, exist_ok=True)
        link(world / first, world / name)
    run(*shlex.split(command))
    for name in made:
        assert (world / name).samefile(world / first), name
    check()


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


def test_every_command_is_tried_and_every_option_that_names_an_output_is_known():
    """An output that counted as an input would be refused the second time."""
    parsers = next(a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    assert {command.split()[0] for command, _ in COMMANDS + SLOW} == {*parsers} - NONE
    named = {
        action.dest for parser in parsers.values() for action in parser._actions
        if str(action.help).startswith("write") and action.metavar
    }  # fmt: skip
    assert named <= {*OUTPUTS}
