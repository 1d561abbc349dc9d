"""The notebooks run from the first cell to the last, and say what they promise."""

from __future__ import annotations

from pathlib import Path

import nbclient
import nbformat
import pytest

from tests.conftest import ROOT, obstacle

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))

pytestmark = [
    # the kernel's messages pass between two processes of this machine
    pytest.mark.filterwarnings("ignore::DeprecationWarning:(zmq|jupyter_client|nbclient)"),
    pytest.mark.filterwarnings("ignore::RuntimeWarning:(zmq|jupyter_client|nbclient)"),
]


def run(path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Everything that its cells print."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    # every warning is an error: what a notebook teaches should not need excuses
    monkeypatch.setenv("PYTHONWARNINGS", "error:::mitsuba_diffraction")
    notebook = nbformat.read(path, as_version=4)
    folder = {"metadata": {"path": str(path.parent)}}
    # a cell takes seconds; a machine that does ten things at once may take ten times as long
    nbclient.NotebookClient(notebook, timeout=300, resources=folder).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output.get("text", "") for output in outputs)


def test_there_are_notebooks():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_small_and_has_been_run(path):
    assert path.stat().st_size < 500_000
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert any(
        output.output_type == "display_data"
        for c in notebook.cells
        for output in c.get("outputs", [])
    )
    assert all(o.output_type != "error" for c in notebook.cells for o in c.get("outputs", []))


def test_the_depth_of_a_grating_is_recovered_to_one_per_cent(monkeypatch):
    if reason := obstacle("llvm_ad_mono"):
        pytest.skip(reason)
    printed = run(ROOT / "notebooks" / "recover_grating_depth.ipynb", monkeypatch)
    *_, line = printed.strip().splitlines()
    recovered, true = float(line.split()[1]), float(line.split("true ")[1].split()[0])
    assert recovered == pytest.approx(true, rel=0.01)
