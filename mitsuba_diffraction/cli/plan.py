"""`mitsuba-diffraction plan`: which part of its tables a scene needs, and what that saves."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from .arguments import number_between, path_ending_in, whole_number
from .console import say_warning
from .output import check_writable
from .progress import Bar
from .report import lines_of, save_json
from .scene_options import add_scene_options, scene_parameters

if TYPE_CHECKING:
    from ..scene.planning.difference import Difference
    from ..scene.planning.make import RecordedScene, TestedPlan
    from ..scene.planning.plan import Plan

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
    add_scene_options(parser)
    add_plan_options(parser)
    parser.add_argument(
        "-o", "--output", metavar="PLAN", type=path_ending_in(".json"),
        help="write the plan, for `render --plan PLAN`",
    )  # fmt: skip
    parser.add_argument(
        "--json", metavar="FILE", type=path_ending_in(".json"), help="write the report as JSON"
    )
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
    for path in (args.output, args.json):
        if path is not None:
            check_writable(path)
    if args.paths > _MOST_PATHS:
        args.parser.error(f"argument --paths: at most {_MOST_PATHS}, got {args.paths}")

    from ..scene.load import load_scene, sensor_of
    from ..scene.planning.make import find_plan, record_scene
    from .console import warnings_as_ours

    variant = planning_variant(args.mode)
    tolerance: float = args.plan_tolerance
    with warnings_as_ours(), Bar(args, delay=0) as bar:

        def load() -> Any:
            return load_scene(args.scene, parameters)

        def sensor(scene: Any) -> Any:
            return sensor_of(scene, args.sensor)

        bar(0, 0, "tracing paths")
        loaded = record_scene(load, sensor, args.paths, timing=True)
        found = find_plan(str(args.scene), loaded, load, sensor, tolerance, bar, timing=True)
        plan, planned, seconds = found.plan, found.planned, found.seconds
        say_if_unsuited(found)
        bar(0, 0, "timing look-ups")
        report = {
            "scene": str(args.scene),
            "variant": variant,
            "paths": loaded.seen.paths,
            "tolerance": tolerance,
            "tables": [_of_table(key, loaded, plan, planned, seconds) for key in plan.tables],
            **_of_picture(plan, found.difference),
        }
    loaded.session.close()
    for line in lines_of(report):
        print(line)
    if args.json is not None:
        save_json(args.json, report)
    if args.output is not None:
        plan.save(args.output)
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


def _of_table(
    key: str, loaded: RecordedScene, plan: Plan, planned: dict[str, Any], seconds: dict[str, float]
) -> dict[str, Any]:
    from ..plugin.sampling import sampler_bytes
    from ..scene.planning.domain import lobes_in_a_pixel, wavelengths_needed
    from ..scene.planning.lookups import evaluation_ratio

    table, mine = loaded.session.tables[key], plan.tables[key]
    result: dict[str, Any] = {"surfaces": ", ".join(mine.surfaces), "heights": mine.name}
    whole = {
        "memory_mb": table.nbytes / 1e6,
        "sampling_memory_mb": sampler_bytes(table) / 1e6,
        "build_s": loaded.session.seconds.get(key, math.nan),
        "terms": f"{table.expansion.intervals} x {table.expansion.terms}",
        "precision": str(table.coefficients.dtype),
        "taps": list(table.grid.taps),
    }
    asked = loaded.statistics.get(key)
    if asked is None:
        return result | {"asked for": "nothing: no path meets it; it stays whole", "whole": whole}
    bsdfs = [n for n, (_, bsdf) in enumerate(loaded.session.bsdfs) if bsdf.table is table]
    lobes = max(
        (lobes_in_a_pixel(float(loaded.seen.lobe_turn[n]), table.sigma) for n in bsdfs),
        default=math.nan,
    )
    light = asked.light
    result["asked for"] = {
        "share of the surfaces' light that is diffracted": float(light.sum()),
        "frequency (rad/µm)": _shares(asked.frequency, light, "light can probe", table.reach),
        "frequency along x (rad/µm)": _shares(asked.along[0], light),
        "frequency along y (rad/µm)": _shares(asked.along[1], light),
        "kappa (rad/µm)": _shares(asked.kappa, light, "the table has", table.expansion.kappa_max),
        "wavelengths of 99.9 %": wavelengths_needed(asked),
        "lobes of the window in a pixel": lobes,
        "coherence": _coherence(table.coherence, lobes),
    }
    if mine.domain is None:
        return result | {
            "needs": "all of it: a smaller table would save too little",
            "whole": whole,
        }
    smaller = planned[key]
    return result | {
        "needs": {
            "frequency (rad/µm), along x and y": list(mine.domain.crop),
            "kappa (rad/µm)": mine.domain.kappa_max,
            "tolerance of the table": mine.domain.tolerance,
            "share of the light outside, read from coarse cells": mine.domain.outside,
        },
        "whole": whole,
        "planned": {
            "memory_mb": smaller.nbytes / 1e6,
            "sampling_memory_mb": sampler_bytes(smaller) / 1e6,
            "build_s": seconds.get(key, math.nan),
            "terms": f"{smaller.expansion.intervals} x {smaller.expansion.terms}",
            "precision": str(smaller.coefficients.dtype),
            "taps": list(smaller.grid.taps),
            "time of a look-up / that in the whole": evaluation_ratio(asked, table, smaller),
        },
        "times less memory": table.nbytes / smaller.nbytes,
    }


def _shares(values: Any, light: Any, name: str = "", limit: float = 0.0) -> dict[str, float]:
    """Below which values there are these shares of the light, and the largest that could be."""
    from ..scene.planning.domain import quantiles

    below = [0.5, 0.99, 0.999]
    found = {
        f"{100 * share:g} % of the light below": value
        for share, value in zip(below, quantiles(values, light, below), strict=True)
    }
    return found | ({name: limit} if name else {})


def _coherence(given: str, lobes: float) -> str:
    if not lobes >= 0.0:
        return f"{given}; the camera does not see the surface itself"
    if given == "patch" and lobes > 16.0:
        return "patch; a pixel averages so many lobes that ensemble would show the same, for less"
    if given == "ensemble" and lobes < 1.0:
        return "ensemble; a pixel is narrower than a lobe, patch would show its speckle"
    return f"{given}, as it is"


def _of_picture(plan: Plan, measured: Difference | None) -> dict[str, Any]:
    if measured is None or not plan.limits():
        return {"gain": "none: every table is needed as it is"}
    return {
        "picture, planned against whole, same random numbers": {
            "mean difference / mean (XYZ)": measured.relative,
            "below the tolerance": measured.relative <= plan.tolerance,
            "delta E 2000, mean": measured.delta_e_mean,
            "delta E 2000, 99 %": measured.delta_e_99,
            "pixels": list(measured.size),
            "samples per pixel": measured.spp,
        }
    }
