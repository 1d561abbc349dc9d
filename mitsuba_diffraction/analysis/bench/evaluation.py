"""`eval`, `sample` and `pdf` of all contenders, random directions."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
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
    ON_SURFACE,
    ONE_WINDOW,
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
_EVAL = "× eval"
_BASELINES = {
    "× roughconductor": ALUMINIUM, "× defaults": DEFAULT, "× patch": ONE_WINDOW, "× gathers": FLOOR,
}  # fmt: skip


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
        ON_SURFACE: [
            Goal("at most 1.5× patch", ratio(times[ON_SURFACE], times[ONE_WINDOW]) <= 1.5)
        ],
        THESIS: [Goal("at least 30× the defaults", to_thesis >= 30.0)],
    }
    return _section(f"eval: {_conditions(plan, tables)}", times, lanes, goals)


def measure_sampling(plan: Plan, tables: Tables, progress: Progress) -> list[Section]:
    """Nanoseconds for `sample`, `eval_pdf` and `pdf`, beside those of `eval` in the same rounds."""
    queries = _queries(plan, False)
    context, factories = mi.BSDFContext(), bsdf_factories(tables)
    drawing = (context, queries.si, queries.sample1, queries.sample2)
    calls: dict[str, Callable[[], Any]] = {}
    names = (ALUMINIUM, DEFAULT, DEFAULT_AL)
    for name in names:
        bsdf = factories[name]()
        calls[f"sample {name}"] = partial(bsdf.sample, *drawing)
        for what in ("eval", "eval_pdf", "pdf"):
            calls[f"{what} {name}"] = partial(getattr(bsdf, what), context, queries.si, queries.wo)
    lanes = dict.fromkeys(calls, plan.lanes)
    times = _nanoseconds(plan, calls, lanes, "eval, sample and pdf", progress)
    sections = []
    for what, most in (("sample", 1.5), ("eval_pdf", 1.15), ("pdf", None)):
        own = {name: times[f"{what} {name}"] for name in names}
        evals = {name: ratio(own[name], times[f"eval {name}"]) for name in names}
        goals = {
            name: [Goal(f"at most {most:g}× eval", evals[name] <= most)]
            for name in (DEFAULT, DEFAULT_AL)
            if most is not None
        }
        title = f"{what}: {_conditions(plan, tables)}"
        found = _section(title, own, dict.fromkeys(own, plan.lanes), goals)
        for row in found.rows:
            row.values[_EVAL] = evals[row.name]
        sections.append(replace(found, columns=(*found.columns, _EVAL)))
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
