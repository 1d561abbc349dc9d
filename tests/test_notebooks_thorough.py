"""Most notebooks run anew, smaller: no warnings, the same pictures, and what they promise."""

from __future__ import annotations

import nbformat
import numpy as np
import pytest

from docs.make.figures.notebooks import execute
from mitsuba_diffraction.heights import gratings
from tests.support import ROOT
from tests.support.instruments import nanoscope
from tests.support.notebooks import (
    NOTEBOOKS,
    check,
    hindrance,
    read,
    streams,
)

pytestmark = [
    pytest.mark.thorough,
    # the kernel's messages pass between two processes of this machine
    pytest.mark.filterwarnings("ignore::DeprecationWarning:(zmq|jupyter_client|nbclient)"),
    pytest.mark.filterwarnings("ignore::RuntimeWarning:(zmq|jupyter_client|nbclient)"),
]


#: Run by `make notebooks` alone: half of all the notebooks' time, and their calls have tests.
LONG = "shaders_against_path_tracing", "solved_orders", "speed_and_accuracy"


@pytest.mark.parametrize(
    "path", [path for path in NOTEBOOKS if path.stem not in LONG], ids=lambda path: path.stem
)
def test_it_runs_without_a_warning_and_keeps_its_promises(path, tmp_path):
    check(path, tmp_path)


def test_another_scan_takes_one_line(tmp_path):
    """From a NanoScope file to a table, by the notebook that makes a scan of its own."""
    pytest.importorskip("SurfaceTopography", reason="instrument files need the extra afm")
    notebook = read(ROOT / "notebooks" / "from_scan_to_bsdf.ipynb")
    if reason := hindrance(notebook):
        pytest.skip(reason)
    heights = gratings.elaphe_like(extent=6.0, pixels=96, depth=0.04).heights
    counts = np.round((heights - 0.02) * 1e6).astype(np.int16)
    (tmp_path / "scan.spm").write_bytes(nanoscope(counts, scan_size="6 6 ~m"))
    # what comes after the table takes the table
    end = next(
        n for n, c in enumerate(notebook.cells) if "## What the treatment changed" in c.source
    )
    del notebook.cells[end:]
    own = 'SCAN = folder / "practice.gwy"'
    (cell,) = [cell for cell in notebook.cells if cell.source.startswith(own)]
    cell.source = cell.source.replace(own, 'SCAN = "scan.spm"', 1)
    nbformat.write(notebook, tmp_path / "own.ipynb")
    now = execute(tmp_path / "own.ipynb")
    assert streams(now, "stderr") == ""
    assert "HeightField('scan.spm', 96 x 96 pixels of 0.0625 x 0.0625 µm" in streams(now, "stdout")
    assert "from the true heights" not in streams(now, "stdout")
