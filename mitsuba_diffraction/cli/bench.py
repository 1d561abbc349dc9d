"""`mitsuba-diffraction bench`: speed and memory, side by side in one run."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import DiffractionError
from .arguments import path_ending_in
from .console import say_warning
from .heights_options import add_heights_options, load_options, was_given
from .output import check_writable
from .progress import Bar
from .report import save_json

if TYPE_CHECKING:
    from ..analysis.bench.figures import Section
    from ..analysis.bench.plan import Plan

PARTS = ("build", "eval", "sample", "render", "snake", "noise", "efficiency", "colours", "scaling")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "bench",
        help="measure speed and memory",
        description=(
            "Measure what tables cost to build, and what evaluation costs beside Mitsuba's "
            "roughconductor and other baselines, all in one run: compare its ratios, and its "
            "times only on an idle machine."
        ),
    )
    parser.add_argument("--quick", action="store_true", help="fewer, smaller and shorter runs")
    parser.add_argument(
        "--json", metavar="FILE", type=path_ending_in(".json"),
        help="write every single measurement as well",
    )  # fmt: skip
    parser.add_argument(
        "--against", metavar="FILE", type=path_ending_in(".json"),
        help="compare with an earlier run, written by --json",
    )  # fmt: skip
    parser.add_argument("--only", choices=PARTS, help="measure only this")
    parser.add_argument(
        "--scenes", metavar="FOLDER", type=Path, default=Path("scenes"),
        help="where the project's scenes are, for its snake; default: scenes",
    )  # fmt: skip
    parser.add_argument(
        "heights",
        metavar="HEIGHTS",
        type=Path,
        nargs="?",
        help="patch to evaluate, from any file of heights; default: gratings.elaphe_like",
    )
    add_heights_options(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Measure and print, and return the exit code; a missed goal is no failure."""
    if args.json is not None:
        check_writable(args.json)
    if args.heights is None and was_given(args):
        args.parser.error(f"{was_given(args)[0]} needs a file of heights")
    from ..analysis.bench.history import compared, read_run

    earlier = read_run(args.against) if args.against is not None else None
    parts = (args.only,) if args.only else PARTS
    if not {"snake", "efficiency", "colours"}.isdisjoint(parts):
        _check_scenes(args.scenes)
    from tqdm import tqdm

    from ..analysis.bench import plan
    from ..analysis.bench.machine import describe_machine

    chosen = plan.QUICK if args.quick else plan.FULL
    machine = describe_machine()
    print("; ".join(f"{name} {value}" for name, value in machine.items()), flush=True)
    if machine["load"] > 0.5 * machine["cores"]:
        say_warning("the machine is busy: trust the ratios, not the times")
    sections = []
    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder, Bar(args) as bar:
        for section in _sections(parts, chosen, Path(folder), bar, args):
            tqdm.write("\n".join(["", *section.lines()]))  # above the progress bar
            sys.stdout.flush()
            sections.append(section)
    goals = [goal for section in sections for goal in section.goals]
    if goals:
        print(f"\n{sum(goal.met for goal in goals)} of {len(goals)} goals met")
    data = {
        "machine": machine,
        "plan": asdict(chosen),
        "sections": [section.plain() for section in sections],
    }
    if earlier is not None:
        print(f"\nnow / {args.against}")
        print("\n".join(compared(earlier, data)))
    if args.json is not None:
        save_json(args.json, data)
    return 0


def _check_scenes(folder: Path) -> None:
    """Before anything is measured."""
    if not (folder / "snake.xml").is_file():
        raise DiffractionError(
            f"'{folder / 'snake.xml'}' does not exist; name the folder of the project's scenes "
            "with --scenes, or measure a part without them: --only build, eval, sample, render "
            "or noise"
        )


def _sections(
    parts: tuple[str, ...], plan: Plan, folder: Path, bar: Bar, args: argparse.Namespace
) -> Iterator[Section]:
    """Everything that is asked for, one after the other."""
    if "build" in parts:
        from ..analysis.bench.build import measure_builds

        yield measure_builds(plan, folder, bar)
    if set(parts) <= {"build"}:
        return
    import drjit as dr

    from ..analysis.bench.colours import measure_colours
    from ..analysis.bench.contenders import build_tables
    from ..analysis.bench.evaluation import measure_eval, measure_sampling
    from ..analysis.bench.rendering import measure_rendering, measure_snake
    from ..analysis.bench.scaling import measure_lookups, measure_pictures
    from ..analysis.bench.variance import measure_efficiency, measure_noise
    from ..heights.load import load_heights
    from ..scene.load import set_variant

    patch = None
    if args.heights is not None:
        patch = load_heights(args.heights, load_options(args))
    tables = build_tables(plan, folder, bar, patch)
    for backend in ("llvm", "cuda"):
        if not dr.has_backend(getattr(dr.JitBackend, backend.upper())):
            continue
        set_variant(f"{backend}_ad_spectral")
        if "eval" in parts:
            yield measure_eval(plan, tables, bar)
        if "sample" in parts:
            yield from measure_sampling(plan, tables, bar)
        if "render" in parts:
            yield measure_rendering(plan, tables, bar)
        if "snake" in parts:
            yield measure_snake(plan, tables, args.scenes, bar)
        if "noise" in parts:
            yield measure_noise(plan, tables, bar)
        if "efficiency" in parts:
            yield measure_efficiency(plan, tables, args.scenes, bar)
        if "colours" in parts:
            yield from measure_colours(plan, tables, args.scenes, backend, bar)
        if "scaling" in parts:
            set_variant(f"{backend}_ad_spectral")
            yield measure_lookups(plan, folder, bar)
            yield measure_pictures(plan, tables, bar)
