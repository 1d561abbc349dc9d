"""The notebooks run from the first cell to the last, and keep what they promise."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import nbformat
import pytest

from docs.make.figures.notebooks import execute, main
from mitsuba_diffraction import DiffractionError
from tests.support import ROOT
from tests.support.variants import obstacle

pytestmark = [
    # the kernel's messages pass between two processes of this machine
    pytest.mark.filterwarnings("ignore::DeprecationWarning:(zmq|jupyter_client|nbclient)"),
    pytest.mark.filterwarnings("ignore::RuntimeWarning:(zmq|jupyter_client|nbclient)"),
]

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def read(path: Path) -> Any:
    """A notebook as it is kept."""
    return nbformat.read(path, as_version=4)


def code(notebook: Any) -> str:
    """The source of all its cells of code."""
    return "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")


def streams(notebook: Any, name: str) -> str:
    """Everything that its cells write to stdout or stderr."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output.text for output in outputs if output.get("name") == name)


def kinds(notebook: Any) -> list[list[tuple[str, ...]]]:
    """What each of its cells shows: which streams, pictures and values, not what is in them.

    A stream counts once however many pieces it comes in: a slow machine's come in more.
    """
    cells = [
        [(o.output_type, o.get("name", ""), *sorted(o.get("data", ()))) for o in cell.outputs]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]
    return [
        [kind for n, kind in enumerate(cell) if kind[0] != "stream" or kind not in cell[n - 1 : n]]
        for cell in cells
    ]


def hindrance(notebook: Any) -> str | None:
    """Why a notebook cannot run on this machine, or None if it can."""
    source = code(notebook)
    for variant in re.findall(r"set_variant\(\"(\w+)\"\)", source):
        if reason := obstacle(variant):
            return reason
    if "SurfaceTopography" in source and not importlib.util.find_spec("SurfaceTopography"):
        return "SurfaceTopography (extra afm) is not installed"
    return None


#: What takes long and changes nothing that is tested, and what stands for it here.
SMALLER = {
    "first_render": {
        "phi=0, resolution=150)": "phi=0, resolution=150, step=20)",
        "--resolution 150 -o": "--resolution 150 --step 20 -o",
        "extent=13, pixels=256": "extent=13, pixels=128",
        '"sample_count": 49': '"sample_count": 16',
        "resolution=100, step=10": "resolution=40, step=40",
    },
    "from_scan_to_bsdf": {"resolution=100, step=10": "resolution=40, step=40"},
    # rows are alike: fewer have the same mean
    "recover_grating_depth": {'"height": 32': '"height": 10'},
}


def smaller(path: Path, folder: Path) -> Path:
    """A copy of a notebook with fewer samples, depths and rounds, and energy conserved coarsely."""
    notebook = read(path)
    for old, new in SMALLER.get(path.stem, {}).items():
        assert old in code(notebook), old
        for cell in notebook.cells:
            cell.source = cell.source.replace(old, new)
    first = next(cell for cell in notebook.cells if cell.cell_type == "code")
    first.source = (
        "from tests.support.coarse import coarse_energy\n"
        "from tests.support.kernels import compile_quickly\n"
        f"coarse_energy()\ncompile_quickly()\n{first.source}"
    )
    nbformat.write(notebook, folder / path.name)
    return folder / path.name


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_small_and_has_been_run(path):
    assert path.stat().st_size < 500_000
    notebook = read(path)
    nbformat.validate(notebook)
    assert any(kind[0] == "display_data" for cell in kinds(notebook) for kind in cell)
    assert all(kind[0] != "error" for cell in kinds(notebook) for kind in cell)


def written(path: Path, *cells: str) -> Path:
    """A notebook of these cells of code, not run."""
    made = [nbformat.v4.new_code_cell(text) for text in cells]
    nbformat.write(nbformat.v4.new_notebook(cells=made), path)
    return path


def test_what_a_notebook_shows_is_kept_in_its_file(tmp_path, capsys):
    path = written(tmp_path / "sum.ipynb", "print(2 + 3)")
    assert main([str(path)]) == 0
    assert streams(read(path), "stdout") == "5\n"
    assert "execution" not in read(path).cells[0].metadata
    assert re.search(r"sum\.ipynb: \d+\.\d s, \d+ kB", capsys.readouterr().out)


def test_a_cell_that_fails_is_named_and_the_file_stays(tmp_path, capsys):
    path = written(tmp_path / "wrong.ipynb", "x = 1", "assert x == 2, 'one is not two'", "x = 3")
    before = path.read_bytes()
    assert main([str(path)]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1] == (
        f"notebooks: error: '{path}': cell [2] fails: AssertionError: one is not two"
    )
    assert path.read_bytes() == before


#: Run by `make notebooks` alone: half of all the notebooks' time, and their calls have tests.
LONG = "shaders_against_path_tracing", "solved_orders", "speed_and_accuracy"


@pytest.mark.thorough
@pytest.mark.parametrize(
    "path", [path for path in NOTEBOOKS if path.stem not in LONG], ids=lambda path: path.stem
)
def test_it_runs_without_a_warning_and_keeps_its_promises(path, tmp_path):
    before = read(path)
    if reason := hindrance(before):
        pytest.skip(reason)
    try:
        now = execute(smaller(path, tmp_path))
    except DiffractionError as error:
        if "no OpenGL without a window" not in str(error):
            raise
        pytest.skip(str(error))
    # what a notebook teaches should not need excuses
    assert streams(now, "stderr") == ""
    # whoever only reads it sees what it shows
    assert kinds(now) == kinds(before)
    # its cells hold their results against what the text says
    assert re.search(r"^\s*(assert |np\.testing\.assert_)", code(now), re.M)
