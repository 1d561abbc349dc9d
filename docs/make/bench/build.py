"""Building tables: time and memory, each table in a process of its own."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_diffraction import DiffractionTable, HeightField, gratings
from mitsuba_diffraction.analysis.timing import PIXEL
from mitsuba_diffraction.orders.solve import jobs
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.system import peak_memory

from .figures import Goal, Plan, Row, Section

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
    return Section(title, rows)


def _measured(case: Case, folder: Path) -> Row:
    with new_process() as child:
        report = child(_build, _heights(case.side, folder), case.arguments)
    peak, imported = report["peak_bytes"] / 1e9, report["imported_bytes"] / 1e9
    error = max(report["table"]["measured_error"].values()) / report["table"]["tolerance"]
    values = {
        "s": report["seconds"], "s of all cores": report["cpu_seconds"], "GB at most": peak,
        "GB above the import": peak - imported, "error/tolerance": error,
    }  # fmt: skip
    goals = case.goals(report["seconds"], peak)
    return Row(case.name, values, goals, {"arguments": case.arguments, **report})


def _heights(side: int, folder: Path) -> Path:
    """File with the heights of a patch, made where it is missing (which takes a while)."""
    file = folder / f"heights-{side}.npy"
    if not file.is_file():
        with new_process() as child:
            child(_make, file, side)
    return file


@contextlib.contextmanager
def new_process() -> Iterator[Callable[..., Any]]:
    """Yield a function that calls others in one new process."""
    with jobs.processes(1) as executor:
        yield lambda work, *arguments: executor.submit(work, *arguments).result()


def _build(heights: Path, arguments: dict[str, Any]) -> dict[str, Any]:
    """Build the table of the heights in a file; return time, memory and the table's summary."""
    imported = peak_memory()
    patch = HeightField(np.load(heights), PIXEL, name="elaphe_like")
    start, start_cpu = time.perf_counter(), time.process_time()
    table = DiffractionTable.build(patch, **arguments)
    return {
        "seconds": time.perf_counter() - start,
        "cpu_seconds": time.process_time() - start_cpu,
        "peak_bytes": peak_memory(),
        "imported_bytes": imported,
        "table": {k: v for k, v in table.summary().items() if k != "source"},
    }


def _make(heights: Path, side: int) -> None:
    """Write the heights of a patch with so many pixels a side."""
    np.save(heights, gratings.elaphe_like(side * PIXEL, side).heights)
