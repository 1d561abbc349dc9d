"""`mitsuba-diffraction bench`: speed and memory, side by side in one run."""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from ..errors import DiffractionError
from . import options
from .arguments import path_ending_in
from .console import Bar, say_warning
from .report import save_report

PARTS = ("build", "eval", "sample", "snake", "noise", "efficiency", "colours")


def add_parser(subparsers: options.Subparsers) -> None:
    """Declare the sub-command."""
    parser = options.add_command(
        subparsers, "bench", run, "measure speed and memory",
        "Measure what tables cost to build, and what evaluation costs beside Mitsuba's "
        "roughconductor and other baselines, all in one run: compare its ratios, and its "
        "times only on an idle machine.",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="fewer, smaller and shorter runs")
    options.add_json(parser, "every single measurement")
    parser.add_argument(
        "--against", metavar="FILE", type=path_ending_in(".json"),
        help="compare with an earlier run, written by --json",
    )  # fmt: skip
    parser.add_argument("--only", choices=PARTS, help="measure only this")
    parser.add_argument(
        "--scenes", metavar="FOLDER", type=Path, default=Path("scenes"),
        help="where the project's scenes are, for its snake; default: scenes",
    )  # fmt: skip
    options.add_own_patch(parser)


def run(args: argparse.Namespace) -> int:
    """Measure and print, and return the exit code; a missed goal is no failure."""
    options.check_own_patch(args)
    from ..analysis.bench.figures import compared, read_run

    earlier = read_run(args.against) if args.against is not None else None
    parts = (args.only,) if args.only else PARTS
    if not {"snake", "efficiency", "colours"}.isdisjoint(parts):
        _check_scenes(args.scenes)
    from tqdm import tqdm

    from ..analysis.bench import figures, sections
    from ..analysis.bench.figures import describe_machine

    chosen = figures.QUICK if args.quick else figures.FULL
    machine = describe_machine()
    print("; ".join(f"{name} {value}" for name, value in machine.items()), flush=True)
    if machine["load"] > 0.5 * machine["cores"]:
        say_warning("the machine is busy: trust the ratios, not the times")
    measured = []
    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder, Bar(args) as bar:
        for section in sections(
            parts, chosen, Path(folder), bar, args.scenes, options.own_patch(args)
        ):
            tqdm.write("\n".join(["", *section.lines()]))  # above the progress bar
            sys.stdout.flush()
            measured.append(section)
    goals = [goal for section in measured for goal in section.goals]
    if goals:
        print(f"\n{sum(goal.met for goal in goals)} of {len(goals)} goals met")
    data = {
        "machine": machine,
        "plan": asdict(chosen),
        "sections": [section.plain() for section in measured],
    }
    if earlier is not None:
        print(f"\nnow / {args.against}")
        print("\n".join(compared(earlier, data)))
    save_report(args, data)
    return 0


def _check_scenes(folder: Path) -> None:
    """Before anything is measured."""
    if not (folder / "snake.xml").is_file():
        raise DiffractionError(
            f"'{folder / 'snake.xml'}' does not exist; name the folder of the project's scenes "
            "with --scenes, or measure a part without them: --only build, eval, sample or noise"
        )
