"""`mitsuba-diffraction plan`: which part of its tables a scene needs, and what that saves."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from .arguments import number_between, path_ending_in, whole_number
from .console import mitsuba_warnings, say_warning
from .options import add_json, add_scene, scene_parameters
from .output import check_writable
from .progress import Bar
from .report import lines_of, save_report

if TYPE_CHECKING:
    from ..scene.planning.make import TestedPlan

PATHS, TOLERANCE = 1 << 15, 1e-3
_MOST_PATHS = 1 << 22  # lanes are counted in single precision


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "plan",
        help="find out which part of its tables a scene needs",
        description=(
            "Trace paths through an XML scene and report which spatial frequencies, kappa and "
            "wavelengths its diffracting surfaces are asked for, what tables of only these save "
            "and what they change, measured on a small picture. `render --plan` renders with them."
        ),
    )
    add_scene(parser)
    add_plan_options(parser)
    parser.add_argument(
        "-o", "--output", metavar="PLAN", type=path_ending_in(".json"),
        help="write the plan, for `render --plan PLAN`",
    )  # fmt: skip
    add_json(parser)
    parser.set_defaults(run=run, parser=parser)


def add_plan_options(parser: argparse.ArgumentParser) -> None:
    """Declare --paths and --plan-tolerance."""
    parser.add_argument(
        "--paths", metavar="N", type=whole_number(2), default=PATHS,
        help=f"paths to trace for a plan; default: {PATHS}",
    )  # fmt: skip
    parser.add_argument(
        "--plan-tolerance", metavar="ERROR", type=number_between(1e-5, 0.1), default=TOLERANCE,
        help=f"share of a surface's light that a plan may leave outside; default: {TOLERANCE:g}",
    )  # fmt: skip


def planning_variant(asked: str | None) -> str:
    """The variant to trace paths in, which need wavelengths and many lanes; it is set.

    Raises
    ------
    DiffractionError
        If a plan would say nothing about the asked one.
    """
    from ..scene.load import set_variant

    name = set_variant(asked)
    if "spectral" not in name:
        raise DiffractionError(
            f"--mode {name}: a plan is of wavelengths and spatial frequencies, which only spectral "
            "variants look up; RGB variants have a table of colours that stays as it is"
        )
    return set_variant(f"{'cuda' if name.startswith('cuda') else 'llvm'}_ad_spectral")


def run(args: argparse.Namespace) -> int:
    """Plan, report, and return the exit code."""
    parameters = scene_parameters(args)
    if args.output is not None:
        check_writable(args.output)
    if args.paths > _MOST_PATHS:
        args.parser.error(f"argument --paths: at most {_MOST_PATHS}, got {args.paths}")

    from ..scene.load import load_scene, sensor_of
    from ..scene.planning.make import find_plan, record_scene
    from ..scene.planning.report import describe

    variant = planning_variant(args.mode)
    tolerance: float = args.plan_tolerance
    with mitsuba_warnings(), Bar(args, delay=0) as bar:

        def load() -> Any:
            return load_scene(args.scene, parameters)

        def sensor(scene: Any) -> Any:
            return sensor_of(scene, args.sensor)

        bar(0, 0, "tracing paths")
        loaded = record_scene(load, sensor, args.paths, timing=True)
        found = find_plan(str(args.scene), loaded, load, sensor, tolerance, bar, timing=True)
        say_if_unsuited(found)
        bar(0, 0, "timing look-ups")
        report = {
            "scene": str(args.scene),
            "variant": variant,
            "paths": loaded.traced.paths,
            "tolerance": tolerance,
            **describe(loaded, found),
        }
    loaded.session.close()
    for line in lines_of(report):
        print(line)
    save_report(args, report)
    if args.output is not None:
        found.plan.save(args.output)
        print(f"{args.output}: for mitsuba-diffraction render {args.scene} --plan {args.output}")
    return 0


def say_if_unsuited(found: TestedPlan) -> None:
    """Warn of a scene whose picture no plan keeps."""
    if not found.suits and found.difference is not None:
        say_warning(
            f"the picture still differs by {found.difference.relative:.2g}, more than "
            f"{found.plan.tolerance:g}: no plan suits this scene, its tables stay whole"
        )


def plan_or_json(text: str) -> Path:
    """The file of a plan; what stands after a --plan without one may well be the scene."""
    if not text.lower().endswith(".json"):
        raise argparse.ArgumentTypeError(
            f"expected a plan ending in .json, got {text!r}; to have one made, write SCENE --plan"
        )
    return Path(text)
