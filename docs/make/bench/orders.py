"""Gratings with solved orders: times beside `roughconductor`, and the noise of one sample."""

from __future__ import annotations

import statistics
from functools import partial
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from mitsuba_diffraction.analysis.timing import (
    Queries,
    kernel_operations,
    kernel_time,
    ratio,
    rounds_of,
)
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.progress import Progress

from .figures import Goal, Plan, Row, Section
from .scenes import AZIMUTHS, WAVELENGTHS, deviation_of

_ROUGH = "roughconductor, Al"
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
    return [_times(plan, {_ROUGH: rough, **bsdfs}, progress), _noise(plan, bsdfs, progress)]


def _load(table: Path) -> Any:
    if not table.is_file():
        raise DiffractionError(
            f"'{table}' does not exist; solve it with 'mitsuba-diffraction solve "
            f"{table.with_suffix('.toml')}'"
        )
    return mi.load_dict({"type": "diffraction_orders", "filename": str(table)})


def _times(plan: Plan, bsdfs: dict[str, Any], progress: Progress) -> Section:
    queries, context = Queries.random(plan.lanes), mi.BSDFContext()
    numbers = queries.sample1, queries.sample2
    calls = {
        (what, name): partial(
            getattr(bsdf, what),
            context,
            queries.si,
            *(numbers if what == "sample" else (queries.wo,)),
        )
        for what in _TIMES
        for name, bsdf in bsdfs.items()
    }
    timed = {f"{what} {name}": partial(kernel_time, c) for (what, name), c in calls.items()}
    measured = rounds_of(timed, plan.rounds, lambda done, total: progress(done, total, "orders"))
    seconds = {name: [each.seconds for each in taken] for name, taken in measured.items()}
    rows = []
    for what, name in calls:
        taken, baseline = seconds[f"{what} {name}"], seconds[f"{what} {_ROUGH}"]
        times, most = ratio(taken, baseline), _TIMES[what]
        goals = []
        if most is not None and name != _ROUGH:
            goals = [Goal(f"at most {most:g}× roughconductor", times <= most)]
        values: dict[str, float | None] = {
            "ns/call": 1e9 * statistics.median(taken) / plan.lanes,
            "CPU ns/call": 1e9
            / plan.lanes
            * statistics.median(each.cpu_seconds for each in measured[f"{what} {name}"]),
            "× roughconductor": times,
            "operations": kernel_operations(calls[what, name]),
        }
        rows.append(Row(f"{what} {name}", values, goals, {"seconds": taken}))
    title = (
        f"solved orders: {mi.variant()}, {plan.lanes} random pairs of directions; kernels alone, "
        f"medians of {plan.rounds} rounds"
    )
    columns = "ns/call", "CPU ns/call", "× roughconductor", "operations"
    return Section(title, columns, rows)


def _noise(plan: Plan, bsdfs: dict[str, Any], progress: Progress) -> Section:
    rows: list[Row] = []
    for name, bsdf in bsdfs.items():
        for theta, most in _NOISE.items():
            progress(len(rows), len(bsdfs) * len(_NOISE), "noise")
            deviations = [
                deviation_of(bsdf, theta, phi, wavelength, plan.lanes)[0]
                for phi in AZIMUTHS
                for wavelength in WAVELENGTHS
            ]
            worst = max(deviations)
            values: dict[str, float | None] = {
                "median": float(np.median(deviations)),
                "most": worst,
            }
            goals = [Goal(f"at most {most:g}", worst <= most)]
            rows.append(
                Row(f"{name}, {theta:g}°", values, goals, {"standard deviations": deviations})
            )
    title = "noise of solved orders: relative standard deviation of one sample's albedo"
    return Section(title, ("median", "most"), rows)
