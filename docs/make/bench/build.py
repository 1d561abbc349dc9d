"""Building tables: time and memory, each table in a process of its own.

That process is `python -m ...build HEIGHTS.npy PIXEL_SIZE ARGUMENTS`, the last being those of
`DiffractionTable.build` as JSON; or `... HEIGHTS.npy PIXEL_SIZE make SIDE`, which makes the
heights.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_diffraction.analysis.timing import PIXEL
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights import HeightField, gratings
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.system import peak_memory
from mitsuba_diffraction.tables import DiffractionTable

from .figures import Goal, Plan, Row, Section

_COLUMNS = ("s", "s of all cores", "GB at most", "GB above the import", "error/tolerance")
#: Side of the patch: seconds and GB that its table may take at the default tolerance.
_GOALS = {1332: (4.0, 0.6), 4096: (40.0, 2.5), 8192: (300.0, 6.0)}


@dataclass(frozen=True)
class Case:
    """A table to build."""

    name: str
    side: int
    arguments: dict[str, Any] = field(default_factory=dict)

    def goals(self, seconds: float, gigabytes: float) -> list[Goal]:
        """Goals for time and memory of a table with default settings."""
        if self.arguments or self.side not in _GOALS:
            return []
        most_seconds, most_gigabytes = _GOALS[self.side]
        return [
            Goal(f"at most {most_seconds:g} s", seconds <= most_seconds),
            Goal(f"{most_gigabytes:g} GB", gigabytes <= most_gigabytes),
        ]


def cases(plan: Plan) -> Iterator[Case]:
    """Yield the tables that are built."""
    for side in (plan.pixels, *plan.more_pixels):
        yield Case(f"{side}² pixels, the defaults", side)
    if plan.other_tables:
        side = plan.pixels
        yield Case(f"{side}² pixels, tolerance 1e-4", side, {"tolerance": 1e-4})
        yield Case(f"{side}² pixels, patch", side, {"coherence": "patch"})
        yield Case(f"{side}² pixels, Taylor", side, {"basis": "taylor"})


def measure_builds(plan: Plan, folder: Path, progress: Progress) -> Section:
    """Build each of the cases once."""
    todo = list(cases(plan))
    rows = []
    for n, case in enumerate(todo):
        progress(n, len(todo), case.name)
        rows.append(_measured(case, folder))
    progress(len(todo), len(todo), "built")
    title = (
        "build: a table of gratings.elaphe_like, pixels of "
        f"{PIXEL:.4g} µm, its error measurement included; each once, in a process of its own"
    )
    return Section(title, _COLUMNS, rows)


def _measured(case: Case, folder: Path) -> Row:
    report = json.loads(
        _child(str(_heights(case.side, folder)), repr(PIXEL), json.dumps(case.arguments))
    )
    peak, imported = report["peak_bytes"] / 1e9, report["imported_bytes"] / 1e9
    error = max(report["table"]["measured_error"].values()) / report["table"]["tolerance"]
    values = (report["seconds"], report["cpu_seconds"], peak, peak - imported, error)
    return Row(
        case.name,
        dict(zip(_COLUMNS, values, strict=True)),
        case.goals(report["seconds"], peak),
        {"arguments": case.arguments, **report},
    )


def _heights(side: int, folder: Path) -> Path:
    """File with the heights of a patch, made where it is missing (which takes a while)."""
    file = folder / f"heights-{side}.npy"
    if not file.is_file():
        _child(str(file), repr(PIXEL), "make", str(side))
    return file


def _child(*arguments: str) -> str:
    """Run a child process; return its output."""
    result = subprocess.run(
        [sys.executable, "-m", f"{__package__}.build", *arguments],
        env=child_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if result.returncode != 0:
        last = (result.stderr.strip().splitlines() or ["no message"])[-1]
        raise DiffractionError(f"building a table in a child process failed: {last}")
    return result.stdout


def child_environment() -> dict[str, str]:
    """Return the environment of a child that finds the package where this process did.

    It has one thread for linear algebra, as commands have.
    """
    threads = {"OPENBLAS_NUM_THREADS": "1"}
    return {
        **threads,
        **os.environ,
        "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
    }


def build(heights: str, pixel_size: float, arguments: str) -> None:
    """Build the table of the heights in a file, and print time, memory and the table's summary."""
    imported = peak_memory()
    patch = HeightField(np.load(heights), pixel_size, name="elaphe_like")
    start, start_cpu = time.perf_counter(), time.process_time()
    table = DiffractionTable.build(patch, **json.loads(arguments))
    report = {
        "seconds": time.perf_counter() - start,
        "cpu_seconds": time.process_time() - start_cpu,
        "peak_bytes": peak_memory(),
        "imported_bytes": imported,
        "table": {k: v for k, v in table.summary().items() if k != "source"},
    }
    print(json.dumps(report))


def make(heights: str, pixel_size: float, side: int) -> None:
    """Write the heights of a patch with so many pixels a side."""
    np.save(heights, gratings.elaphe_like(side * pixel_size, side).heights)


if __name__ == "__main__":
    if sys.argv[3] == "make":
        make(sys.argv[1], float(sys.argv[2]), int(sys.argv[4]))
    else:
        build(sys.argv[1], float(sys.argv[2]), sys.argv[3])
