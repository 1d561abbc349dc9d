"""Whole pictures: the snake with a skin that diffracts, and with one of `roughconductor`."""

from __future__ import annotations

import statistics
import time
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

from ...progress import Progress
from .contenders import Tables
from .figures import Goal, Row, Section
from .plan import Plan
from .scenes import share_of, skin_of, snake_scene
from .timing import ratio, rounds_of

_COLUMNS = ("ms", "ns/sample", "× roughconductor")
_SKIN, _ROUGH = "the skin diffracts, pigment beneath", "the skin is roughconductor, Al"


def measure_snake(plan: Plan, tables: Tables, scenes: Path, progress: Progress) -> Section:
    """Time to render the snake's scene as it is, and with `roughconductor` for its skin."""
    size = {"resx": str(2 * plan.resolution), "resy": str(5 * plan.resolution // 4)}
    made = {name: snake_scene(scenes, tables, **size) for name in (_SKIN, _ROUGH)}
    rough = mi.load_dict({"type": "twosided", "b": {"type": "roughconductor", "material": "Al"}})
    skin_of(made[_ROUGH]).set_bsdf(rough)
    covered = share_of(made[_SKIN], skin_of(made[_SKIN]))
    calls = {name: partial(render_seconds, scene, plan) for name, scene in made.items()}
    rounds = max(3, plan.rounds // 2)
    seconds = rounds_of(calls, rounds, lambda done, total: progress(done, total, "snake"))
    rows = []
    samples = int(size["resx"]) * int(size["resy"]) * plan.spp
    for name, taken in seconds.items():
        median = statistics.median(taken)
        to_rough = ratio(taken, seconds[_ROUGH])
        values = (1e3 * median, 1e9 * median / samples, to_rough)
        goals = [Goal("at most 2.5×", to_rough <= 2.5)] if name == _SKIN else []
        rows.append(Row(name, dict(zip(_COLUMNS, values, strict=True)), goals, {"seconds": taken}))
    title = (
        f"snake: {mi.variant()}, scenes/snake.xml, {size['resx']} × {size['resy']} pixels, "
        f"{100 * covered:.0f} % of them snake, {plan.spp} samples per pixel; medians of {rounds} "
        "rounds"
    )
    return Section(title, _COLUMNS, rows)


def render_seconds(scene: Any, plan: Plan) -> float:
    """How long one picture takes, compiling included where it is the first."""
    start = time.perf_counter()
    dr.eval(mi.render(scene, spp=plan.spp))
    dr.sync_thread()
    return time.perf_counter() - start
