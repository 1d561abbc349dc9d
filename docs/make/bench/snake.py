"""Time of the snake's picture, with our skin and with Mitsuba's `roughconductor`.

Each scene is in a process of its own: kernels record virtual calls of every BSDF that is alive.
"""

from __future__ import annotations

import statistics
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

from docs.make.figures.pages import Seconds
from mitsuba_diffraction.analysis.timing import ratio, rounds_of
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.scene import set_variant

from .build import new_process
from .contenders import Tables
from .figures import Goal, Plan, Row, Section
from .kernels import kernel_operations
from .scenes import pixels_of, skin_of, snake_scene

_SKIN, _ROUGH = "the skin diffracts, pigment beneath", "the skin is roughconductor, Al"
# the scene of a child
_loaded: dict[str, Any] = {}


def measure_snake(plan: Plan, tables: Tables, scenes: Path, progress: Progress) -> Section:
    """Time to render the snake's scene as it is, and with `roughconductor` for its skin."""
    width, height = 2 * plan.resolution, 5 * plan.resolution // 4
    rounds = max(3, plan.rounds // 2)
    with ExitStack() as stack:
        children = {name: stack.enter_context(new_process()) for name in (_SKIN, _ROUGH)}
        about = {
            name: child(
                _load, name, scenes, tables.paths["default"], mi.variant(), width, height, plan.spp
            )
            for name, child in children.items()
        }
        calls = {name: partial(child, _render, plan.spp) for name, child in children.items()}
        taken = rounds_of(calls, rounds, lambda done, total: progress(done, total, "snake"))
    seconds, busy = (
        {name: [each[n] for each in rendered] for name, rendered in taken.items()} for n in (0, 1)
    )
    rows = []
    for name in children:
        median, processor = statistics.median(seconds[name]), statistics.median(busy[name])
        times = ratio(seconds[name], seconds[_ROUGH])
        values: dict[str, float | None] = {
            "ms": 1e3 * median, "CPU ms": 1e3 * processor,
            "ns/sample": 1e9 * median / (width * height * plan.spp),
            "× roughconductor": times,
            "CPU, × roughconductor": ratio(busy[name], busy[_ROUGH]),
            "operations": about[name]["operations"],
        }  # fmt: skip
        goals = [Goal("at most 2.5×", times <= 2.5)] if name == _SKIN else []
        raw = {"seconds": seconds[name], "cpu_seconds": busy[name]}
        rows.append(Row(name, values, goals, raw))
    title = (
        f"snake: {mi.variant()}, scenes/snake.xml, {width} × {height} pixels, "
        f"{100 * about[_SKIN]['covered']:.0f} % of them snake, {plan.spp} samples per pixel; "
        f"medians of {rounds} rounds"
    )
    return Section(title, rows)


def _load(
    skin: str, scenes: Path, table: Path, variant: str, width: int, height: int, spp: int
) -> dict[str, float]:
    """Load the scene of this process, and return the facts about it."""
    set_variant(variant)
    scene = snake_scene(scenes, table, resx=str(width), resy=str(height))
    if skin == _ROUGH:
        metal = {"type": "roughconductor", "material": "Al"}
        skin_of(scene).set_bsdf(mi.load_dict({"type": "twosided", "b": metal}))
    _loaded["scene"] = scene
    covered = float(pixels_of(scene, skin_of(scene)).mean())
    operations = kernel_operations(partial(mi.render, scene, spp=spp))
    return {"covered": covered, "operations": operations}


def _render(spp: int) -> Seconds:
    """Return the time of a picture, with its tracing in Python."""
    start, busy = time.perf_counter(), time.process_time()
    dr.eval(mi.render(_loaded["scene"], spp=spp))
    dr.sync_thread()
    return Seconds(time.perf_counter() - start, time.process_time() - busy)
