"""Time of the snake's picture, with our skin and with Mitsuba's `roughconductor`.

Each scene is in a process of its own, `python -m ...snake SKIN SCENES TABLE VARIANT SIZES`:
kernels record virtual calls of every BSDF that is alive. It renders once for each line that it
reads, and writes the seconds and processor seconds as JSON.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

from mitsuba_diffraction.analysis.timing import kernel_operations, ratio, rounds_of
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.scene.load import set_variant

from .build import child_environment
from .contenders import Tables
from .figures import Goal, Plan, Row, Section
from .scenes import pixels_of, skin_of, snake_scene

_COLUMNS = ("ms", "CPU ms", "ns/sample", "× roughconductor", "CPU, × roughconductor", "operations")
_SKIN, _ROUGH = "the skin diffracts, pigment beneath", "the skin is roughconductor, Al"


def measure_snake(plan: Plan, tables: Tables, scenes: Path, progress: Progress) -> Section:
    """Time to render the snake's scene as it is, and with `roughconductor` for its skin."""
    width, height = 2 * plan.resolution, 5 * plan.resolution // 4
    arguments = [str(x) for x in (scenes, tables.paths["default"], mi.variant())]
    sizes = [str(n) for n in (width, height, plan.spp)]
    rounds = max(3, plan.rounds // 2)
    with ExitStack() as stack:
        children = {
            name: stack.enter_context(_Child([skin, *arguments, *sizes]))
            for name, skin in ((_SKIN, "ours"), (_ROUGH, "rough"))
        }
        calls = {name: child.answer for name, child in children.items()}
        about = {name: call() for name, call in calls.items()}
        taken = rounds_of(calls, rounds, lambda done, total: progress(done, total, "snake"))
    seconds, busy = (
        {name: [each[key] for each in rendered] for name, rendered in taken.items()}
        for key in ("seconds", "cpu_seconds")
    )
    rows = []
    for name in children:
        median, processor = statistics.median(seconds[name]), statistics.median(busy[name])
        ratios = ratio(seconds[name], seconds[_ROUGH]), ratio(busy[name], busy[_ROUGH])
        nanoseconds = 1e9 * median / (width * height * plan.spp)
        operations = about[name]["operations"]
        values = (1e3 * median, 1e3 * processor, nanoseconds, *ratios, operations)
        goals = [Goal("at most 2.5×", ratios[0] <= 2.5)] if name == _SKIN else []
        raw = {"seconds": seconds[name], "cpu_seconds": busy[name]}
        rows.append(Row(name, dict(zip(_COLUMNS, values, strict=True)), goals, raw))
    title = (
        f"snake: {mi.variant()}, scenes/snake.xml, {width} × {height} pixels, "
        f"{100 * about[_SKIN]['covered']:.0f} % of them snake, {plan.spp} samples per pixel; "
        f"medians of {rounds} rounds"
    )
    return Section(title, _COLUMNS, rows)


class _Child:
    """Process that renders; its first answer is about the scene."""

    def __init__(self, arguments: list[str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__, *arguments], env=child_environment(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def __enter__(self) -> _Child:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.communicate()  # closes its input, which ends it

    def answer(self) -> Any:
        """Return the answer to a line."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            print(file=self._process.stdin, flush=True)
            return json.loads(self._process.stdout.readline())
        except (OSError, ValueError) as error:
            raise DiffractionError("rendering the snake in a child process failed") from error


def _serve(skin: str, scenes: str, table: str, variant: str, *sizes: str) -> None:
    """Answer each line: the first one about the scene, others by the time of a picture."""
    set_variant(variant)
    width, height, spp = sizes
    scene = snake_scene(Path(scenes), Path(table), resx=width, resy=height)
    if skin == "rough":
        metal = {"type": "roughconductor", "material": "Al"}
        skin_of(scene).set_bsdf(mi.load_dict({"type": "twosided", "b": metal}))
    for line, _ in enumerate(sys.stdin):
        start, busy = time.perf_counter(), time.process_time()
        if line == 0:
            covered = float(pixels_of(scene, skin_of(scene)).mean())
            operations = kernel_operations(partial(mi.render, scene, spp=int(spp)))
            answer: dict[str, float] = {"covered": covered, "operations": operations}
        else:
            dr.eval(mi.render(scene, spp=int(spp)))
            dr.sync_thread()
            wall = time.perf_counter() - start
            answer = {"seconds": wall, "cpu_seconds": time.process_time() - busy}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    _serve(*sys.argv[1:])
