"""Gratings with solved orders: times beside `roughconductor`, and the noise of one sample."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mitsuba as mi

from mitsuba_diffraction.analysis.timing import ratio
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.progress import Progress

from .contenders import ALUMINIUM
from .evaluation import called, calls_of, time_calls, timed_section
from .figures import Goal, Plan, Row, Section
from .scenes import noise_row

#: Shipped tables, bare and under a clear layer.
_TABLES = {"blazed grating, Al": "blazed.nc", "CD": "cd.nc"}
#: Time of a call at most, over that of `roughconductor`.
_TIMES = {"eval": 2.0, "sample": 3.0, "eval_pdf": None}
#: Angle of incidence, degrees: relative standard deviation that one sample may have.
_NOISE = {0.0: 0.1, 45.0: 0.15, 75.0: 0.2}


def measure_orders(plan: Plan, scenes: Path, progress: Progress) -> list[Section]:
    """Measure `eval`, `sample` and `eval_pdf`, and the noise of one sample."""
    bsdfs = {name: _load(scenes.parent / "precompute/orders" / f) for name, f in _TABLES.items()}
    rough = mi.load_dict({"type": "roughconductor", "material": "Al"})
    return [_times(plan, {ALUMINIUM: rough, **bsdfs}, progress), _noise(plan, bsdfs, progress)]


def _load(table: Path) -> Any:
    if not table.is_file():
        raise DiffractionError(
            f"'{table}' does not exist; solve it with 'mitsuba-diffraction solve "
            f"{table.with_suffix('.toml')}'"
        )
    return mi.load_dict({"type": "diffraction_orders", "filename": str(table)})


def _times(plan: Plan, bsdfs: dict[str, Any], progress: Progress) -> Section:
    calls = calls_of(bsdfs, _TIMES, plan.lanes)
    timed, sections = time_calls(plan, calls, "orders", progress), []
    for what, most in _TIMES.items():
        times = called(timed, what)
        rough = times[ALUMINIUM].clock
        goals = {
            name: [Goal(f"at most {most:g}× roughconductor", ratio(each.clock, rough) <= most)]
            for name, each in times.items()
            if most is not None and name != ALUMINIUM
        }
        sections.append(timed_section(what, times, goals))
    title = (
        f"solved orders: {mi.variant()}, {plan.lanes} random pairs of directions; kernels alone, "
        f"medians of {plan.rounds} rounds"
    )
    rows = [replace(row, name=f"{s.title} {row.name}") for s in sections for row in s.rows]
    return Section(title, rows)


def _noise(plan: Plan, bsdfs: dict[str, Any], progress: Progress) -> Section:
    rows: list[Row] = []
    for name, bsdf in bsdfs.items():
        for theta, most in _NOISE.items():
            progress(len(rows), len(bsdfs) * len(_NOISE), "noise")
            rows.append(noise_row(f"{name}, {theta:g}°", bsdf, theta, most, plan.lanes))
    title = "noise of solved orders: relative standard deviation of one sample's albedo"
    return Section(title, rows)
