"""Measure what tables cost to build, and what evaluation costs beside Mitsuba's roughconductor.

python -m docs.make.bench --json out/bench.json
python -m docs.make.bench --quick --only eval
python -m docs.make.bench --measured scale.png --pixel-size 0.0488 --max-height 0.375

All candidates are timed in one run: compare its ratios, and its times only on an idle machine.
"""

from __future__ import annotations

import argparse
import functools
import gc
import sys
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

import drjit as dr

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.machine import describe_machine
from mitsuba_diffraction.cli import Bar, check_outputs, save_json
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.scene import set_variant

from ..figures.pages import (
    from_json,
    measured_options,
    measured_patch,
    option,
    program,
    progress_option,
)
from . import figures
from .build import measure_builds
from .contenders import build_tables
from .evaluation import measure_colours, measure_eval, measure_sampling
from .figures import Plan, Section
from .orders import measure_orders
from .scenes import measure_efficiency, measure_noise
from .snake import measure_snake
from .survey import measure_survey
from .updates import measure_updates

PARTS = (
    "build", "survey", "eval", "sample", "snake", "orders", "noise", "efficiency", "update",
    "colours", "frames",
)  # fmt: skip


def _check_scenes(folder: Path) -> None:
    """Refuse a folder without the project's scenes, before anything is measured."""
    for name in ("snake.xml", "textures/elaphe.png", "meshes/elaphe.ply"):
        if not (folder / name).is_file():
            raise DiffractionError(
                f"'{folder / name}' does not exist; name the folder of the project's scenes with "
                "--scenes, or measure a part without them: --only build, eval, sample, noise or "
                "update"
            )


def _sections(
    parts: Collection[str],
    plan: Plan,
    folder: Path,
    progress: Progress,
    scenes: Path,
    patch: HeightField | None,
) -> Iterator[Section]:
    """Measure parts one after the other, those with kernels on every backend of this machine.

    folder : for temporary files.
    patch : evaluated instead of the plan's own.
    """
    tables = functools.cache(lambda: build_tables(plan, folder, progress, patch))

    def frames() -> list[Section]:
        from .frames import measure_frames

        return [measure_frames(plan, tables(), scenes, progress)]

    def made(measures: dict[str, Callable[[], Iterable[Section]]]) -> Iterator[Section]:
        for part, measure in measures.items():
            if part in parts:
                yield from measure()
                gc.collect()  # the next part's kernels would hold the code of BSDFs of this one

    yield from made({
        "build": lambda: [measure_builds(plan, folder, progress)],
        "survey": lambda: [measure_survey(plan, folder, progress)],
    })  # fmt: skip
    for backend in ("llvm", "cuda"):
        if dr.has_backend(getattr(dr.JitBackend, backend.upper())):
            set_variant(f"{backend}_ad_spectral")
            yield from made({
                "eval": lambda: [measure_eval(plan, tables(), progress)],
                "sample": lambda: measure_sampling(plan, tables(), progress),
                "snake": lambda: [measure_snake(plan, tables(), scenes, progress)],
                "orders": lambda: measure_orders(plan, scenes, progress),
                "noise": lambda: [measure_noise(plan, tables(), progress)],
                "efficiency": lambda: [measure_efficiency(plan, tables(), scenes, progress)],
                "update": lambda: [measure_updates(folder, progress)],
                "colours": lambda: measure_colours(plan, tables(), scenes, progress),
            })  # fmt: skip
    yield from made({"frames": frames})


@program(
    option("--quick", action="store_true", help="fewer, smaller and shorter runs"),
    option("--json", metavar="FILE", type=Path, help="write every single measurement"),
    option(
        "--against", metavar="FILE", type=Path,
        help="compare with an earlier run, written by --json",
    ),
    option("--only", nargs="+", choices=PARTS, help="measure only these"),
    option(
        "--scenes", metavar="FOLDER", type=Path, default=Path("scenes"),
        help="folder of the project's scenes; default: scenes",
    ),
    progress_option(),
    *measured_options("height field to measure; default: gratings.elaphe_like"),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Measure and print. A missed goal changes no exit code."""
    from tqdm import tqdm

    if args.json is not None:
        check_outputs([args.json])
    earlier = None
    if args.against is not None:
        earlier = from_json(
            args.against, lambda run: {part: run[part] for part in ("machine", "sections")},
            writer="docs.make.bench --json", remedy="give such a file",
        )  # fmt: skip
    parts = tuple(args.only or PARTS)
    if not {"snake", "orders", "efficiency", "colours", "frames"}.isdisjoint(parts):
        _check_scenes(args.scenes)
    patch = measured_patch(args)
    plan = figures.QUICK if args.quick else figures.FULL
    machine = describe_machine()
    print("; ".join(f"{name} {value}" for name, value in machine.items()), flush=True)
    if machine["load"] > 0.5 * machine["cores"]:
        print("warning: the machine is busy: trust the ratios, not the times", file=sys.stderr)
    measured = []
    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder, Bar(args) as bar:
        for section in _sections(parts, plan, Path(folder), bar, args.scenes, patch):
            tqdm.write("\n".join(["", *section.lines()]))  # above the progress bar
            sys.stdout.flush()
            measured.append(section)
    goals = [goal for section in measured for goal in section.goals]
    if goals:
        print(f"\n{sum(goal.met for goal in goals)} of {len(goals)} goals met")
    data = {
        "machine": machine,
        "plan": asdict(plan),
        "sections": [section.plain() for section in measured],
    }
    if earlier is not None:
        print(f"\nnow / {args.against}")
        print("\n".join(figures.compared(earlier, data)))
    if args.json is not None:
        save_json(args.json, data)
