"""RGB variants beside spectral ones: their colours, their table, their speed."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..colour import delta_e, linear_srgb, response
from ..maps.light import Light
from ..tables.colour_table import ColourTable
from .contenders import Queries, Tables
from .figures import Goal, Row, Section
from .plan import Plan
from .scenes import pixels_of, skin_of, snake_scene
from .timing import kernel_seconds, rounds_of

Progress = Callable[[int, int, str], None]

#: What reflects, and whether the goals are for it.
MATERIALS: dict[str, tuple[dict[str, Any], bool]] = {
    "dielectric 1.5": ({}, True),
    "none": ({"material": "none"}, True),
    "aluminium": ({"material": "Al"}, False),
    "gold": ({"material": "Au"}, False),
}
_LIGHTS = ((0.0, 0.0), (30.0, 0.0), (30.0, 90.0), (60.0, 45.0))
_STEP = 2.5  # nm
_COLUMNS = ("mean ΔE2000", "99th percentile", "pixels")


def measure_colours(
    plan: Plan, tables: Tables, scenes: Path, backend: str, progress: Progress
) -> list[Section]:
    """Differences between the RGB and the spectral variant, then size, time and speed.

    Leaves the spectral variant set.
    """
    rgb, spectral = f"{backend}_ad_rgb", f"{backend}_ad_spectral"
    rows = []
    total = len(MATERIALS) + 2
    for n, (name, (parameters, strict)) in enumerate(MATERIALS.items()):
        progress(n, total, "colours")
        # energy conservation is the same factor in both
        values = [
            _map(tables, variant, {**parameters, "energy_conserving": False}, plan.map_resolution)
            for variant in (spectral, rgb)
        ]
        rows.append(_difference(f"map, {name}", *values, strict))
    progress(len(MATERIALS), total, "colours")
    rows.append(_snake(plan, tables, scenes, spectral, rgb))
    progress(total - 1, total, "colours")
    differences = Section(
        f"colours: {rgb} against {spectral} at {_STEP:g} nm, {plan.map_resolution}² directions of "
        f"view for each of {len(_LIGHTS)} of the light; and scenes/snake.xml, path-traced in both",
        _COLUMNS,
        rows,
    )
    cost = _cost(plan, tables, rgb, spectral)
    progress(total, total, "colours")
    return [differences, cost]


def _difference(name: str, reference: Any, other: Any, strict: bool) -> Row:
    found = delta_e(reference, other)
    found = found[np.isfinite(found)]
    mean, high = float(found.mean()), float(np.percentile(found, 99.0))
    goals = [Goal("mean at most 1", mean <= 1.0), Goal("99 % at most 3", high <= 3.0)]
    values = dict(zip(_COLUMNS, (mean, high, float(found.size)), strict=True))
    return Row(name, values, goals if strict else [])


def _map(tables: Tables, variant: str, parameters: dict[str, Any], resolution: int) -> Any:
    """Linear sRGB of f (n, 3) at points of the hemisphere's disc, for all lights."""
    mi.set_variant(variant)
    bsdf = tables.bsdf("default", **parameters)
    x, y = np.meshgrid(*[(np.arange(resolution) + 0.5) * (2.0 / resolution) - 1.0] * 2)
    squared = x**2 + y**2
    inside = squared < 0.97**2
    wo = np.stack([x[inside], y[inside], np.sqrt(1.0 - squared[inside])])
    return np.concatenate([_colours(bsdf, Light(*light).direction, wo) for light in _LIGHTS])


def _colours(bsdf: Any, wi: Any, wo: Any) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, wo.shape[1])
    si.wi = mi.Vector3f(*map(float, wi))
    outgoing = mi.Vector3f(wo.astype(np.float32))
    if mi.is_rgb:
        values = np.array(bsdf.eval(mi.BSDFContext(), si, outgoing), float).T
        return values / wo[2][:, None]
    wavelengths = np.arange(360.0 + 0.5 * _STEP, 830.0, _STEP).reshape(-1, len(mi.Spectrum(0.0)))
    xyz = np.zeros((wo.shape[1], 3))
    for group in wavelengths:
        si.wavelengths = mi.Spectrum(group.tolist())
        values = np.array(bsdf.eval(mi.BSDFContext(), si, outgoing), float)
        xyz += values.T @ response(group) * _STEP
    return linear_srgb(xyz) / wo[2][:, None]


def _snake(plan: Plan, tables: Tables, scenes: Path, spectral: str, rgb: str) -> Row:
    """The snake's own pixels; the sky and the stone have differences of their own."""
    width = plan.resolution // 2
    pictures = []
    for variant in (spectral, rgb):
        mi.set_variant(variant)
        scene = snake_scene(scenes, tables, resx=str(width), resy=str(5 * width // 8))
        pixels = pixels_of(scene, skin_of(scene))
        passes = max(1, plan.reference_spp // 256)
        spp = plan.reference_spp // passes
        mean = np.mean([np.array(mi.render(scene, spp=spp, seed=n)) for n in range(passes)], axis=0)
        pictures.append(mean[..., :3][pixels])
    return _difference("snake, pigment beneath", *pictures, True)


def _cost(plan: Plan, tables: Tables, rgb: str, spectral: str) -> Section:
    start = time.perf_counter()
    table = ColourTable.build(tables.load("default"))
    built = time.perf_counter() - start
    calls: dict[str, list[float]] = {}
    for variant in (rgb, spectral):
        mi.set_variant(variant)
        bsdf = tables.bsdf("default")
        queries = Queries.random(plan.lanes)
        call = partial(bsdf.eval, mi.BSDFContext(), queries.si, queries.wo)
        calls |= rounds_of(
            {variant: partial(kernel_seconds, call)}, plan.rounds, lambda done, total: None
        )
    nanoseconds = {
        variant: 1e9 * statistics.median(taken) / plan.lanes for variant, taken in calls.items()
    }
    times = nanoseconds[rgb] / nanoseconds[spectral]
    megabytes = table.nbytes / 1e6
    columns = ("MB", "s to build", "eval, ns/call", "× spectral")
    goals = [
        Goal("at most 64 MB", megabytes <= 64.0),
        Goal("60 s", built <= 60.0),
        Goal("0.5× spectral", times <= 0.5),
    ]
    values = (megabytes, built, nanoseconds[rgb], times)
    return Section(
        "colour table: of the defaults, what the RGB variants look up",
        columns,
        [Row("elaphe_like", dict(zip(columns, values, strict=True)), goals, {"ns": nanoseconds})],
    )
