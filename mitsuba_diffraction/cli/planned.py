"""Rendering by a plan: made or read before, checked against the scene, and held to afterwards."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from ..progress import Progress
from ..scene.load import sensor_of, set_variant
from .console import say, say_warning
from .plan import planning_variant, say_if_unsuited

if TYPE_CHECKING:
    from ..scene.planning.plan import Plan

#: `--plan` without a file.
MAKE = Path()


@dataclass(frozen=True)
class Planned:
    """A scene with the tables of a plan that fits it.

    Attributes
    ----------
    scene : in the variant that is set.
    plan : its tables.
    tables : by their keys.
    shares : by key, of the light of a table's surfaces that is looked up outside.
    """

    scene: Any
    plan: Plan
    tables: dict[str, Any]
    shares: dict[str, float]


def load_by_plan(
    args: argparse.Namespace, variant: str, load: Callable[[], Any], tell: Progress
) -> Planned | None:
    """A scene with the tables of a plan, or None where the variant has no use for one.

    Raises
    ------
    DiffractionError
        If the plan is for other surfaces, or for a light or a camera of which too much falls
        outside.
    """
    if "spectral" not in variant:
        say_warning(
            f"--plan: {variant} looks up a table of colours or one wavelength, which a plan does "
            "not make smaller; rendering without one"
        )
        return None
    from ..scene.planning.lookups import outside_of
    from ..scene.planning.make import load_planned

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

    def sensor(scene: Any) -> Any:
        return sensor_of(scene, args.sensor)

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
    from ..scene.planning.lookups import outside_of

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
    from .plan import PATHS, TOLERANCE

    for name, default in (("paths", PATHS), ("plan_tolerance", TOLERANCE)):
        if args.plan is None and getattr(args, name) != default:
            option = name.replace("_", "-")
            args.parser.error(f"argument --{option}: is for --plan, which is not given")
    if args.plan is not None and args.plan != MAKE and not args.plan.is_file():
        raise DiffractionError(f"there is no plan '{args.plan}'; check the path")
