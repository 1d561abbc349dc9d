"""What `eval` costs over terms and patches, and a picture over samples and pixels."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import mitsuba as mi

from ...heights import gratings
from ...progress import Progress
from ...tables.table import DiffractionTable
from .contenders import DEFAULT, Queries, Tables, bsdf_makers
from .figures import Row, Section
from .plan import PIXEL, Plan
from .rendering import ball_scene, render_seconds
from .saved import saved_bsdf
from .timing import kernel_seconds, ratio, rounds_of

#: Numbers of one order that are tried, at a tolerance that all of them meet in enough intervals.
TERMS = (4, 8, 16)


_EVAL, _PICTURE = ("ns/call", "× first", "MB", "taps"), ("ms", "× first", "ns/sample")


def measure_lookups(plan: Plan, folder: Path, progress: Progress) -> Section:
    """`eval` of tables of different patches, and of different numbers of terms."""
    tables: dict[str, DiffractionTable] = {}
    for side in plan.sides:
        field = gratings.elaphe_like(side * PIXEL, side)
        tables[f"{side}² pixels, {side * PIXEL:.0f} µm"] = DiffractionTable.build(field)
    field = gratings.elaphe_like(plan.sides[0] * PIXEL, plan.sides[0])
    for terms in TERMS:
        name = f"{plan.sides[0]}² pixels, {terms} terms"
        tables[name] = DiffractionTable.build(field, terms=terms)
    queries, context = Queries.random(plan.lanes), mi.BSDFContext()
    calls: dict[str, Callable[[], Any]] = {}
    for n, (name, table) in enumerate(tables.items()):
        file = folder / f"scaling-{n}.exr"
        table.save(file)
        bsdf = saved_bsdf(file, energy_conserving=False)
        calls[name] = partial(kernel_seconds, partial(bsdf.eval, context, queries.si, queries.wo))
    taken = rounds_of(calls, plan.rounds, lambda done, total: progress(done, total, "scaling"))
    first = next(iter(taken.values()))
    rows = []
    for name, seconds in taken.items():
        table = tables[name]
        each = 1e9 * statistics.median(seconds) / plan.lanes
        values = (each, ratio(seconds, first), table.nbytes / 1e6, float(table.grid.taps_read))
        rows.append(Row(name, dict(zip(_EVAL, values, strict=True)), raw={"seconds": seconds}))
    title = (
        f"scaling: {mi.variant()}, eval of four wavelengths, coherence width 65 µm: a smaller "
        "patch has fewer orders, a larger one more of them within a lobe; medians of "
        f"{plan.rounds} rounds"
    )
    return Section(title, _EVAL, rows)


def measure_pictures(plan: Plan, tables: Tables, progress: Progress) -> Section:
    """Time of a picture over its samples and its pixels."""
    bsdf = bsdf_makers(tables)[DEFAULT]()
    sizes = [(plan.resolution, spp) for spp in (1, 4, 16)]
    sizes += [(side, 4) for side in (plan.resolution // 4, plan.resolution // 2)]
    calls, samples = {}, {}
    for side, spp in sizes:
        name = f"{side}² pixels, {spp} samples each"
        some = replace(plan, resolution=side, spp=spp)
        calls[name] = partial(render_seconds, ball_scene(some, bsdf), some)
        samples[name] = side * side * spp
    taken = rounds_of(calls, plan.rounds, lambda done, total: progress(done, total, "pictures"))
    first = next(iter(taken.values()))
    rows = []
    for name, seconds in taken.items():
        median = statistics.median(seconds)
        values = (1e3 * median, ratio(seconds, first), 1e9 * median / samples[name])
        rows.append(Row(name, dict(zip(_PICTURE, values, strict=True)), raw={"seconds": seconds}))
    title = (
        f"pictures: {mi.variant()}, a ball under a lamp and an even sky; medians of {plan.rounds} "
        "rounds"
    )
    return Section(title, _PICTURE, rows)
