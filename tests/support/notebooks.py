"""The notebooks, what they hold, and copies of them that are quick to run."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nbformat
import pytest

from docs.make.figures.notebooks import execute
from mitsuba_diffraction import DiffractionError
from tests.support import ROOT
from tests.support.variants import obstacle

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


def depth_is_found_to_one_per_cent(printed: str) -> None:
    *_, line = printed.strip().splitlines()
    recovered, true = float(line.split()[1]), float(line.split("true ")[1].split()[0])
    assert recovered == pytest.approx(true, rel=0.01)


#: What a notebook's printed lines have to say, beyond what its own cells assert.
SAYS: dict[str, Callable[[str], None]] = {"recover_grating_depth": depth_is_found_to_one_per_cent}
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


def check(path: Path, folder: Path) -> None:
    """Run a copy in a folder: it gives no warning, shows what the kept one does, says the same."""
    before = read(path)
    if reason := hindrance(before):
        pytest.skip(reason)
    try:
        now = execute(smaller(path, folder))
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
    SAYS.get(path.stem, len)(streams(now, "stdout"))
