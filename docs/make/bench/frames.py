"""Frames of the shaders, each of them drawn by OpenGL without a window."""

from __future__ import annotations

import contextlib
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from mitsuba_diffraction.analysis.timing import rounds_of
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.realtime.glsl import Renderer

from .contenders import Tables
from .figures import Goal, Plan, Row, Section
from .scenes import snake_scene

_SHORTEST = 0.1  # least duration of a timing, s
#: Frames a second at 1920 × 1080 pixels that a graphics card is to draw.
_GOALS = {"fast": 500.0, "exact": 60.0}


def measure_frames(plan: Plan, tables: Tables, scenes: Path, progress: Progress) -> Section:
    """Frames a second of the snake: all lamps and the sky without shadows, and one shadowed light.

    On a software rasteriser, in processor time over the number of cores.
    """
    with contextlib.ExitStack() as stack:
        renderer = Renderer(snake_scene(scenes, tables.paths["default"]))
        stack.callback(renderer.release)
        target = renderer.target(*plan.frame)
        stack.callback(target.release)
        clock = renderer.clock
        calls: dict[str, Callable[[], Any]] = {}
        for method in _GOALS:
            calls[method] = partial(renderer.draw, target.frame, method)
            light = renderer.progressive(method, size=plan.frame)
            stack.callback(light.release)
            calls[f"{method}, one light with shadows"] = light.advance

        def seconds(call: Callable[[], Any]) -> float:
            times = 1
            while True:
                start = clock()
                for _ in range(times):
                    call()
                renderer.context.finish()
                taken = clock() - start
                if taken >= _SHORTEST:
                    return taken / times
                times *= 4

        timed = {name: partial(seconds, call) for name, call in calls.items()}
        taken = rounds_of(timed, plan.rounds, lambda done, total: progress(done, total, "frames"))
        driver = renderer.driver
    rows = []
    for name, each in taken.items():
        median = statistics.median(each)
        goals = []
        if clock is time.perf_counter and name in _GOALS:
            goals = [Goal(f"at least {_GOALS[name]:g} a second", 1.0 / median >= _GOALS[name])]
        values = {"frames/s": 1.0 / median, "ms": 1e3 * median}
        rows.append(Row(name, values, goals, {"seconds": each}))
    width, height = plan.frame
    title = (
        f"frames: {driver}, scenes/snake.xml, {width} × {height} pixels, one sample per pixel; "
        f"medians of {plan.rounds} rounds"
    )
    return Section(title, rows)
