"""`eval`, `sample` and `pdf` of all contenders, random directions."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import mitsuba as mi

from ...progress import Progress
from .contenders import (
    ALUMINIUM,
    COARSE,
    DEFAULT,
    DEFAULT_AL,
    KIRCHHOFF,
    KIRCHHOFF_AL,
    THESIS,
    Queries,
    Tables,
    bare_gathers,
    bsdf_factories,
    is_slow,
    kernel_seconds,
    ratio,
    rounds_of,
)
from .figures import Goal, Plan, Row, Section

FLOOR = "bare gathers of the defaults"
_TIMES = "ns/call"
_BASELINES = {"× roughconductor": ALUMINIUM, "× defaults": DEFAULT, "× gathers": FLOOR}


def measure_eval(plan: Plan, tables: Tables, progress: Progress) -> Section:
    """Nanoseconds for `eval` of four wavelengths, of every contender and of the bare gathers."""
    queries = {slow: _queries(plan, slow) for slow in (False, True)}
    context = mi.BSDFContext()
    calls: dict[str, Callable[[], Any]] = {}
    lanes: dict[str, int] = {}
    for name, make in bsdf_factories(tables).items():
        bsdf = make()
        asked = queries[is_slow(name)]
        lanes[name] = len(asked.sample1)
        calls[name] = partial(bsdf.eval, context, asked.si, asked.wo)
        if name == DEFAULT:
            calls[FLOOR] = bare_gathers(bsdf.table, queries[False])
            lanes[FLOOR] = lanes[name]
    times = _nanoseconds(plan, calls, lanes, "eval", progress)
    to_rough = ratio(times[DEFAULT], times[ALUMINIUM])
    to_thesis = ratio(times[THESIS], times[DEFAULT])
    to_kirchhoff = ratio(times[DEFAULT], times[KIRCHHOFF])
    metals = ratio(times[DEFAULT_AL], times[KIRCHHOFF_AL])
    goals = {
        DEFAULT: [
            Goal("at most 4× roughconductor", to_rough <= 4.0),
            Goal("within 1.5× of bare gathers", ratio(times[DEFAULT], times[FLOOR]) <= 1.5),
            Goal("at most 1.15× kirchhoff", to_kirchhoff <= 1.15),
        ],
        DEFAULT_AL: [Goal("at most 1.25× kirchhoff", metals <= 1.25)],
        COARSE: [Goal("at most 3× roughconductor", ratio(times[COARSE], times[ALUMINIUM]) <= 3.0)],
        THESIS: [Goal("at least 30× the defaults", to_thesis >= 30.0)],
    }
    return _section(f"eval: {_conditions(plan, tables)}", times, lanes, goals)


def measure_sampling(plan: Plan, tables: Tables, progress: Progress) -> list[Section]:
    """Nanoseconds for `sample` and for `pdf`, of the contenders that differ in them."""
    queries = _queries(plan, False)
    context = mi.BSDFContext()
    factories = bsdf_factories(tables)
    chosen = {name: factories[name]() for name in (ALUMINIUM, DEFAULT, DEFAULT_AL)}
    lanes = dict.fromkeys(chosen, plan.lanes)
    sections = []
    for what in ("sample", "pdf"):
        calls: dict[str, Callable[[], Any]] = {}
        for name, bsdf in chosen.items():
            if what == "sample":
                calls[name] = partial(
                    bsdf.sample, context, queries.si, queries.sample1, queries.sample2
                )
            else:
                calls[name] = partial(bsdf.pdf, context, queries.si, queries.wo)
        times = _nanoseconds(plan, calls, lanes, what, progress)
        sections.append(_section(f"{what}: {_conditions(plan, tables)}", times, lanes, {}))
    return sections


def _queries(plan: Plan, slow: bool) -> Queries:
    return Queries.random(plan.slow_lanes if slow else plan.lanes)


def _nanoseconds(
    plan: Plan,
    calls: dict[str, Callable[[], Any]],
    lanes: dict[str, int],
    what: str,
    progress: Progress,
) -> dict[str, list[float]]:
    timed = {name: partial(kernel_seconds, call) for name, call in calls.items()}
    seconds = rounds_of(timed, plan.rounds, lambda done, total: progress(done, total, what))
    return {name: [1e9 * s / lanes[name] for s in taken] for name, taken in seconds.items()}


def _conditions(plan: Plan, tables: Tables) -> str:
    return (
        f"{mi.variant()}, {plan.lanes} random pairs of directions, {_wavelengths()} wavelengths a "
        f"call, {tables.patch} pixels; kernels alone, medians of {plan.rounds} "
        "rounds through all rows, ratios within a round"
    )


def _wavelengths() -> int:
    return len(mi.Spectrum(0.0))


def _section(
    title: str,
    times: dict[str, list[float]],
    lanes: dict[str, int],
    goals: Mapping[str, Sequence[Goal]],
) -> Section:
    baselines = {heading: name for heading, name in _BASELINES.items() if name in times}
    rows = []
    for name, taken in times.items():
        values: dict[str, float | None] = {_TIMES: statistics.median(taken)}
        for heading, baseline in baselines.items():
            values[heading] = ratio(taken, times[baseline])
        raw = {"ns": taken, "lanes": lanes[name]}
        rows.append(Row(name, values, goals.get(name, ()), raw))
    return Section(title, (_TIMES, *baselines), rows)
