"""Measure what tables cost to build, and what evaluation costs beside Mitsuba's roughconductor.

python -m docs.make.bench --json out/bench.json
python -m docs.make.bench --quick --only eval
python -m docs.make.bench --measured scale.png --pixel-size 0.0488 --max-height 0.375

All candidates are timed in one run: compare its ratios, and its times only on an idle machine.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from mitsuba_diffraction.analysis.machine import describe_machine
from mitsuba_diffraction.cli import Bar, check_outputs
from mitsuba_diffraction.cli.console import say_warning
from mitsuba_diffraction.cli.report import save_json
from mitsuba_diffraction.errors import DiffractionError

from ..figures.pages import (
    measured_options,
    measured_patch,
    option,
    program,
    progress_option,
)
from . import figures, sections

PARTS = (
    "build", "survey", "eval", "sample", "snake", "orders", "noise", "efficiency", "update",
    "colours", "frames",
)  # fmt: skip


def _check_scenes(folder: Path) -> None:
    """Refuse a folder without the project's scenes, before anything is measured."""
    if not (folder / "snake.xml").is_file():
        raise DiffractionError(
            f"'{folder / 'snake.xml'}' does not exist; name the folder of the project's scenes "
            "with --scenes, or measure a part without them: --only build, eval, sample, noise or "
            "update"
        )


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
    earlier = figures.read_run(args.against) if args.against is not None else None
    parts = tuple(args.only or PARTS)
    if not {"snake", "orders", "efficiency", "colours", "frames"}.isdisjoint(parts):
        _check_scenes(args.scenes)
    patch = measured_patch(args)
    plan = figures.QUICK if args.quick else figures.FULL
    machine = describe_machine()
    print("; ".join(f"{name} {value}" for name, value in machine.items()), flush=True)
    if machine["load"] > 0.5 * machine["cores"]:
        say_warning("the machine is busy: trust the ratios, not the times")
    measured = []
    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder, Bar(args) as bar:
        for section in sections(parts, plan, Path(folder), bar, args.scenes, patch):
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
