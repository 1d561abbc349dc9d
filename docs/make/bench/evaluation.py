"""`eval`, `sample` and `pdf` of all contenders, random directions; RGB variants beside spectral."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_diffraction.analysis.maps import brdf_map
from mitsuba_diffraction.analysis.timing import Queries, ratio, rounds_of
from mitsuba_diffraction.optics.colour import delta_e, linear_srgb, response
from mitsuba_diffraction.progress import Progress, silent
from mitsuba_diffraction.tables.colour import ColourTable

from .contenders import (
    ALUMINIUM,
    COARSE,
    DEFAULT,
    DEFAULT_AL,
    KIRCHHOFF,
    KIRCHHOFF_AL,
    ON_SURFACE,
    ONE_WINDOW,
    SLOW,
    THESIS,
    Tables,
    bare_gathers,
    bsdf_factories,
)
from .figures import Goal, Plan, Row, Section
from .kernels import kernel_operations, kernel_time, vector_lanes
from .scenes import pigment, rays, snake

FLOOR = "bare gathers of the defaults"
_BASELINES = {
    "× roughconductor": ALUMINIUM, "× defaults": DEFAULT, "× patch": ONE_WINDOW, "× gathers": FLOOR,
}  # fmt: skip

#: What reflects, and whether the goals are for it.
MATERIALS: dict[str, tuple[dict[str, Any], bool]] = {
    "dielectric 1.5": ({}, True),
    "none": ({"material": "none"}, True),
    "aluminium": ({"material": "Al"}, True),
    "gold": ({"material": "Au"}, False),
}
# Of the comparison of colours.
_LIGHTS = ((0.0, 0.0), (30.0, 0.0), (30.0, 90.0), (60.0, 45.0))
_STEP = 2.5  # nm
_SUN = (-0.4, 0.6, 0.8)  # towards it
_RAYS = 4  # along each side of a pixel


def measure_eval(plan: Plan, tables: Tables, progress: Progress) -> Section:
    """Nanoseconds for `eval` of four wavelengths, of every contender and of the bare gathers."""
    queries = {False: Queries.random(plan.lanes), True: Queries.random(plan.slow_lanes)}
    context = mi.BSDFContext()
    calls: dict[str, Callable[[], Any]] = {}
    lanes: dict[str, int] = {}
    for name, make in bsdf_factories(tables).items():
        bsdf = make()
        asked = queries[name in SLOW]
        lanes[name] = len(asked.sample1)
        calls[name] = partial(bsdf.eval, context, asked.si, asked.wo)
        if name == DEFAULT:
            calls[FLOOR] = bare_gathers(bsdf, queries[False])
            lanes[FLOOR] = lanes[name]
    timed = time_calls(plan, calls, "eval", progress, lanes)
    times = {name: each.clock for name, each in timed.items()}
    to_rough = ratio(times[DEFAULT], times[ALUMINIUM])
    to_thesis = ratio(times[THESIS], times[DEFAULT])
    to_kirchhoff = ratio(times[DEFAULT], times[KIRCHHOFF])
    metals = ratio(times[DEFAULT_AL], times[KIRCHHOFF_AL])
    goals = {
        DEFAULT: [
            Goal("at most 4× roughconductor", to_rough <= 4.0),
            Goal("at most 1.4× bare gathers", ratio(times[DEFAULT], times[FLOOR]) <= 1.4),
            Goal("at most 1.15× kirchhoff", to_kirchhoff <= 1.15),
        ],
        DEFAULT_AL: [Goal("at most 1.25× kirchhoff", metals <= 1.25)],
        COARSE: [Goal("faster than the defaults", ratio(times[COARSE], times[DEFAULT]) < 1.0)],
        ON_SURFACE: [
            Goal("at most 1.5× patch", ratio(times[ON_SURFACE], times[ONE_WINDOW]) <= 1.5)
        ],
        THESIS: [Goal("at least 30× the defaults", to_thesis >= 30.0)],
    }
    return timed_section(f"eval: {_conditions(plan, tables)}", timed, goals)


def measure_sampling(plan: Plan, tables: Tables, progress: Progress) -> list[Section]:
    """Nanoseconds for `sample`, `eval_pdf` and `pdf`, beside those of `eval` in the same rounds."""
    factories = bsdf_factories(tables)
    names = (ALUMINIUM, DEFAULT, DEFAULT_AL)
    bsdfs = {name: factories[name]() for name in names}
    calls = calls_of(bsdfs, ("sample", "eval", "eval_pdf", "pdf"), plan.lanes)
    timed, sections = time_calls(plan, calls, "eval, sample and pdf", progress), []
    for what, most in (("sample", 1.5), ("eval_pdf", 1.15), ("pdf", None)):
        evals = {
            name: ratio(timed[f"{what} {name}"].clock, timed[f"eval {name}"].clock)
            for name in names
        }
        goals = {
            name: [Goal(f"at most {most:g}× eval", evals[name] <= most)]
            for name in (DEFAULT, DEFAULT_AL)
            if most is not None
        }
        title = f"{what}: {_conditions(plan, tables)}"
        section = timed_section(title, called(timed, what), goals)
        for row in section.rows:
            row.values["× eval"] = evals[row.name]
        sections.append(section)
    return sections


class Timed(NamedTuple):
    """Times of a call in rounds, in ns a lane: of the clock and of all cores; its operations."""

    clock: list[float]
    processor: list[float]
    lanes: int
    operations: int


def calls_of(
    bsdfs: Mapping[str, Any], functions: Iterable[str], lanes: int
) -> dict[str, Callable[[], Any]]:
    """Return calls of functions of BSDFs, by the names of both, with random numbers of lanes."""
    queries, context = Queries.random(lanes), mi.BSDFContext()
    drawn = queries.sample1, queries.sample2
    return {
        f"{what} {name}": partial(
            getattr(bsdf, what), context, queries.si,
            *(drawn if what == "sample" else (queries.wo,)),
        )
        for what in functions
        for name, bsdf in bsdfs.items()
    }  # fmt: skip


def called(timed: Mapping[str, Timed], what: str) -> dict[str, Timed]:
    """Return the calls whose names begin with a word, without it."""
    start = f"{what} "
    return {n.removeprefix(start): each for n, each in timed.items() if n.startswith(start)}


def time_calls(
    plan: Plan,
    calls: Mapping[str, Callable[[], Any]],
    what: str,
    progress: Progress,
    lanes: Mapping[str, int] | None = None,
) -> dict[str, Timed]:
    """Time calls in rounds.

    lanes : number of lanes of each call; by default the number of lanes of the plan.
    """
    lanes = lanes or dict.fromkeys(calls, plan.lanes)
    kernels = {name: partial(kernel_time, call) for name, call in calls.items()}
    measured = rounds_of(kernels, plan.rounds, lambda done, total: progress(done, total, what))
    return {
        name: Timed(
            *([1e9 / lanes[name] * each[n] for each in measured[name]] for n in (0, 1)),
            lanes[name], kernel_operations(call),
        )
        for name, call in calls.items()
    }  # fmt: skip


def _conditions(plan: Plan, tables: Tables) -> str:
    wavelengths = len(mi.Spectrum(0.0))
    return (
        f"{mi.variant()}, vectors of {vector_lanes()} lanes, {plan.lanes} random pairs of "
        f"directions, {wavelengths} wavelengths a "
        f"call, {tables.patch} pixels; kernels alone, medians of {plan.rounds} "
        "rounds through all rows, ratios within a round"
    )


def timed_section(
    title: str, timed: Mapping[str, Timed], goals: Mapping[str, Sequence[Goal]]
) -> Section:
    """Return a row for each call, with ratios to the baselines among them."""
    baselines = {heading: name for heading, name in _BASELINES.items() if name in timed}
    rows = []
    for name, (clock, processor, lanes, operations) in timed.items():
        values: dict[str, float | None] = {
            "ns/call": statistics.median(clock), "CPU ns/call": statistics.median(processor),
            **{heading: ratio(clock, timed[each].clock) for heading, each in baselines.items()},
            "operations": operations,
        }  # fmt: skip
        raw = {"ns": clock, "cpu_ns": processor, "lanes": lanes}
        rows.append(Row(name, values, goals.get(name, ()), raw))
    return Section(title, rows)


def measure_colours(plan: Plan, tables: Tables, scenes: Path, progress: Progress) -> list[Section]:
    """Differences between the RGB variant and the spectral one that is set; size, time and speed.

    Leaves the spectral variant set.
    """
    spectral = mi.variant()
    rgb = spectral.replace("spectral", "rgb")
    rows = []
    total = len(MATERIALS) + 2
    for n, (name, (parameters, strict)) in enumerate(MATERIALS.items()):
        progress(n, total, "colours")
        # energy conservation is the same factor in both
        values = [
            _map(tables, variant, {**parameters, "energy_conserving": False}, plan.map_resolution)
            for variant in (spectral, rgb)
        ]
        rows.append(_difference(f"map, {name}", values[0], values[1], strict))
    progress(len(MATERIALS), total, "colours")
    skins: dict[str, dict[str, Any]] = {
        "snake in the sun, none": {"material": "none"},
        "snake in the sun, pigment beneath": {"pigment": pigment(scenes)},
    }
    for name, skin in skins.items():
        values = [_snake(plan, tables, scenes, skin, variant) for variant in (spectral, rgb)]
        rows.append(_difference(name, values[0], values[1], True))
    progress(total - 1, total, "colours")
    differences = Section(
        f"colours: {rgb} against {spectral} at {_STEP:g} nm, {plan.map_resolution}² directions of "
        f"view for each of {len(_LIGHTS)} of the light; and the snake",
        rows,
    )
    cost = _cost(plan, tables, rgb, spectral)
    progress(total, total, "colours")
    return [differences, cost]


def _difference(name: str, reference: Any, other: Any, strict: bool) -> Row:
    differences = delta_e(reference, other)
    differences = differences[np.isfinite(differences)]
    mean, high = float(differences.mean()), float(np.percentile(differences, 99.0))
    goals = [Goal("mean at most 1", mean <= 1.0), Goal("99 % at most 3", high <= 3.0)]
    values = {"mean ΔE2000": mean, "99th percentile": high, "pixels": float(differences.size)}
    return Row(name, values, goals if strict else [])


def _map(tables: Tables, variant: str, parameters: dict[str, Any], resolution: int) -> Any:
    """Linear sRGB of f (n, 3) at points of the hemisphere's disc, for all lights."""
    mi.set_variant(variant)
    bsdf = tables.bsdf("default", **parameters)
    x = (np.arange(resolution) + 0.5) * (2.0 / resolution) - 1.0
    inside = x**2 + x[:, None] ** 2 < 0.97**2
    maps = (brdf_map(bsdf, *at, step=_STEP, resolution=resolution, samples=1) for at in _LIGHTS)
    return np.concatenate([each.linear[inside] for each in maps])


def _colours(bsdf: Any, si: Any, wo: Any) -> Any:
    """Linear sRGB (n, 3) of f·cosθo, in either variant."""
    context = mi.BSDFContext()
    if mi.is_rgb:
        return np.array(bsdf.eval(context, si, wo), float).T
    wavelengths = np.arange(360.0 + 0.5 * _STEP, 830.0, _STEP).reshape(-1, len(mi.Spectrum(0.0)))
    xyz = np.zeros((dr.width(wo), 3))
    for group in wavelengths:
        si.wavelengths = mi.Spectrum(group.tolist())
        dr.make_opaque(si.wavelengths)
        xyz += np.array(bsdf.eval(context, si, wo), float).T @ response(group) * _STEP
    return linear_srgb(xyz)


def _snake(plan: Plan, tables: Tables, scenes: Path, skin: dict[str, Any], variant: str) -> Any:
    """Linear sRGB (n, 3) of the pixels of a snake in the sun, at the same points in each variant.

    Not path-traced: the glints of the narrow lobes leave a noise of ΔE 1.5 even at 2048 samples
    a pixel. And not in the light of `scenes`: Mitsuba's RGB variants make its sun and sky 4 to
    6 % brighter than the spectral ones do, whatever they shine on.
    """
    mi.set_variant(variant)
    scene = snake(
        tables.bsdf("default", **skin), scenes, plan.resolution // 2, plan.resolution // 3, {}
    )
    pixels, ray = rays(scene, _RAYS)
    si = scene.ray_intersect(ray)
    sun = si.to_local(mi.Vector3f(_SUN) / dr.norm(mi.Vector3f(_SUN)))
    colours = _colours(scene.shapes()[0].bsdf(), si, sun)
    seen = np.array(si.is_valid(), bool).reshape(pixels, -1).all(axis=1)
    return colours.reshape(pixels, -1, 3).mean(axis=1)[seen]


def _cost(plan: Plan, tables: Tables, rgb: str, spectral: str) -> Section:
    start = time.perf_counter()
    table = ColourTable.build(tables.load("default"))
    built = time.perf_counter() - start
    nanoseconds = {}
    for variant in (rgb, spectral):
        mi.set_variant(variant)
        bsdf, queries = tables.bsdf("default"), Queries.random(plan.lanes)
        call = partial(bsdf.eval, mi.BSDFContext(), queries.si, queries.wo)
        timed = time_calls(plan, {variant: call}, "colours", silent)
        nanoseconds[variant] = statistics.median(timed[variant].clock)
    times = nanoseconds[rgb] / nanoseconds[spectral]
    megabytes = table.nbytes / 1e6
    goals = [
        Goal("at most 64 MB", megabytes <= 64.0),
        Goal("60 s", built <= 60.0),
        Goal("0.5× spectral", times <= 0.5),
    ]
    values = {
        "MB": megabytes, "s to build": built, "eval, ns/call": nanoseconds[rgb],
        "× spectral": times,
    }  # fmt: skip
    return Section(
        "colour table: of the defaults, what the RGB variants look up",
        [Row(tables.patch, values, goals, {"ns": nanoseconds})],
    )
