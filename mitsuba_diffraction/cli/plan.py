"""`mitsuba-diffraction plan`: which part of its tables a scene needs; and `render --plan`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from ..progress import Progress
from ..scene.load import load_scene, sensor_of, set_variant
from . import options
from .console import Bar, mitsuba_warnings, say, say_warning
from .options import number_between, whole_number
from .report import check_writable, lines_of, save_report

if TYPE_CHECKING:
    from ..scene.planning.make import TestedPlan
    from ..scene.planning.plan import Plan


PATHS, TOLERANCE = 1 << 15, 1e-3
_MOST_PATHS = 1 << 22  # lanes are counted in single precision

#: `--plan` without a file.
MAKE = Path()


def add_parser(subparsers: options.Subparsers) -> None:
    parser = options.add_command(
        subparsers, "plan", run, "find out which part of its tables a scene needs",
        "Trace paths through an XML scene and report which spatial frequencies, kappa and "
        "wavelengths its diffracting surfaces are asked for, what tables of only these save "
        "and what they change, measured on a small picture. `render --plan` renders with them.",
    )  # fmt: skip
    options.add_scene(parser)
    add_plan_options(parser)
    options.add_output(parser, "write the plan, for `render --plan PLAN`", ".json", metavar="PLAN")
    options.add_json(parser)


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

    Raises a DiffractionError if a plan would say nothing about the asked one.
    """
    name = set_variant(asked)
    if "spectral" not in name:
        raise DiffractionError(
            f"--mode {name}: a plan is of wavelengths and spatial frequencies, which only spectral "
            "variants look up; RGB variants have a table of colours that stays as it is"
        )
    return set_variant(f"{'cuda' if name.startswith('cuda') else 'llvm'}_ad_spectral")


def run(args: argparse.Namespace) -> int:
    """Plan, report, and return the exit code."""
    parameters = options.scene_parameters(args)
    if args.output is not None:
        check_writable(args.output)
    if args.paths > _MOST_PATHS:
        args.parser.error(f"argument --paths: at most {_MOST_PATHS}, got {args.paths}")

    from ..scene.planning.make import find_plan, record_scene
    from ..scene.planning.report import describe

    variant = planning_variant(args.mode)
    tolerance: float = args.plan_tolerance
    with mitsuba_warnings(), Bar(args, delay=0) as bar:
        load = partial(load_scene, args.scene, parameters)
        sensor = partial(sensor_of, index=args.sensor)
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


@dataclass(frozen=True)
class Planned:
    """A scene with the tables of a plan that fits it."""

    scene: Any  # in the variant that is set
    plan: Plan  # its tables
    tables: dict[str, Any]  # by their keys
    shares: dict[str, float]  # by key, of the light of a table's surfaces that is looked up outside


def load_by_plan(
    args: argparse.Namespace, variant: str, load: Callable[[], Any], tell: Progress
) -> Planned | None:
    """A scene with the tables of a plan, or None where the variant has no use for one.

    Raises a DiffractionError if the plan is for other surfaces, or for a light or a camera of which
    too much falls outside.
    """
    if "spectral" not in variant:
        say_warning(
            f"--plan: {variant} looks up a table of colours or one wavelength, which a plan does "
            "not make smaller; rendering without one"
        )
        return None
    from ..scene.planning.make import load_planned
    from ..scene.planning.report import outside_of

    try:
        plan, shares = _plan(args, variant, load, tell)
    finally:
        set_variant(variant)
    for mine in plan.tables.values():
        names = ", ".join(mine.surfaces)
        before, now = (n / 1e6 for n in mine.memory)
        if mine.domain is None:
            say(f"plan: {names} keeps its whole table of {before:.3g} MB")
        else:
            say(f"plan: {names} has a table of {now:.3g} MB instead of {before:.3g} MB")
    scene, session = load_planned(load, plan)
    tables = dict(session.tables)
    session.close()
    for table in tables.values():
        outside_of(table)  # those of the paths that were traced
    return Planned(scene, plan, tables, shares)


def _plan(
    args: argparse.Namespace, variant: str, load: Callable[[], Any], tell: Progress
) -> tuple[Plan, dict[str, float]]:
    """The plan, and the shares of light outside; in the variant that paths are traced in."""
    from ..scene.planning.make import check_light, find_plan, record_scene
    from ..scene.planning.plan import Plan

    sensor = partial(sensor_of, index=args.sensor)
    given = None if args.plan == MAKE else Plan.load(args.plan)
    planning_variant(variant if variant.startswith(("llvm", "cuda")) else None)
    loaded = record_scene(load, sensor, args.paths, plan=given)
    try:
        if given is not None:
            return given, check_light(loaded, given)
        found = find_plan(str(args.scene), loaded, load, sensor, args.plan_tolerance, tell)
    finally:
        loaded.session.close()
    say_if_unsuited(found)
    plan = found.plan
    return plan, {k: t.domain.outside for k, t in plan.tables.items() if t.domain is not None}


def say_outside(planned: Planned, samples: int) -> None:
    """What was looked up outside the plan, a line for each table."""
    from ..scene.planning.report import outside_of

    for key, table in planned.tables.items():
        found, mine = outside_of(table), planned.plan.tables[key]
        if found is None or not found.count or mine.domain is None:
            continue
        share = planned.shares.get(key)
        light = "" if share is None else f", about {100 * share:.2g} % of the surface's light"
        far = f"|q| up to {found.frequency:.3g} rad/µm, planned "
        far += " × ".join(f"{half:.3g}" for half in mine.domain.crop)
        if found.kappa > mine.domain.kappa_max:
            far += f"; κ up to {found.kappa:.3g}, planned {mine.domain.kappa_max:.3g}"
        say(
            f"plan: {', '.join(mine.surfaces)}: {found.count / samples:.2g} look-ups a sample lay "
            f"outside{light}, and were read from coarse cells ({far})"
        )


def check_plan_options(args: argparse.Namespace) -> None:
    """Refuse options of a plan without one; a usage error."""
    for name, default in (("paths", PATHS), ("plan_tolerance", TOLERANCE)):
        if args.plan is None and getattr(args, name) != default:
            option = name.replace("_", "-")
            args.parser.error(f"argument --{option}: is for --plan, which is not given")
    if args.plan is not None and args.plan != MAKE and not args.plan.is_file():
        raise DiffractionError(f"there is no plan '{args.plan}'; check the path")
