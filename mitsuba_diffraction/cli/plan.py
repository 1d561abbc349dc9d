"""`mitsuba-diffraction plan`: recipes of smaller tables for a scene; and `render --plan`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import DiffractionError
from ..progress import Progress
from ..scene import load_scene, set_variant
from ..scene.load import sensor_of
from ..scene.planning.light import light_of_tables
from ..scene.planning.plan import (
    PlannedTable,
    load_by_recipes,
    load_limited,
    plan_table,
    recipe_files,
    recipe_of,
)
from ..scene.planning.report import describe
from . import options, scene_options
from .console import Bar, say, say_warning
from .report import Figures, check_outputs, lines_of
from .values import number_between, path_ending_in, whole_number

#: How a plan is made.
PLAN = (
    # lanes are counted in single precision
    ("--paths N", "paths to trace for a plan", whole_number(2, 1 << 22), 1 << 17),
    ("--plan-tolerance SHARE", "share of a surface's light that a plan may leave out",
     number_between(1e-5, 0.1), 1e-3),
)  # fmt: skip


def recipe_file(text: str) -> Path:
    """Recipe of a plan. A scene after --plan without a recipe is refused with a hint."""
    if not text.lower().endswith(".toml"):
        raise argparse.ArgumentTypeError(
            f"expected a recipe ending in .toml, got {text!r}; to have one made, write SCENE --plan"
        )
    return Path(text)


def planning_variant(requested: str | None) -> str:
    """Set the variant to trace paths in, which need wavelengths and many lanes; return its name.

    Raises a DiffractionError if a plan would say nothing about the requested variant.
    """
    name = set_variant(requested)
    if "spectral" not in name:
        raise DiffractionError(
            f"--mode {name}: a plan is of wavelengths and spatial frequencies, which only spectral "
            "variants look up; RGB variants have a table of colours that stays as it is"
        )
    return set_variant(f"{'cuda' if name.startswith('cuda') else 'llvm'}_ad_spectral")


@options.command(
    "plan", "find out which part of its tables a scene needs",
    "Trace paths through an XML scene, report which spatial frequencies, kappa and "
    "wavelengths its diffracting surfaces are asked for, and write recipes of tables of only "
    "these, for `precompute` and `render --plan`.",
    *scene_options.SCENE,
    *PLAN,
    ("-o --output OUT.toml", "write the recipe; those of further tables are OUT_2.toml and so "
     "on", path_ending_in(".toml")),
    options.json(),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Plan, report, and return the figures."""
    scene_options.put_on_stage(args)
    parameters = scene_options.scene_parameters(args)
    if args.output is not None:
        check_outputs([args.output])

    variant = planning_variant(args.mode)
    with Bar(args, delay=0) as bar:
        planned = _planned(args, partial(load_scene, args.scene, parameters), bar)
    report = {
        "scene": str(args.scene),
        "variant": variant,
        "paths": args.paths,
        "tolerance": args.plan_tolerance,
        "tables": [describe(table) for table in planned],
    }
    for line in lines_of(report):
        print(line)
    limited = [table for table in planned if table.settings is not None]
    if args.output is not None and not limited:
        say_warning("every table is needed whole: no recipe was written")
    elif args.output is not None:
        files = recipe_files(args.output, len(limited))
        check_outputs(files)
        for file, table in zip(files, limited, strict=True):
            recipe, comment = recipe_of(table, str(args.scene))
            recipe.save(file, comment)
        names = " ".join(map(str, files))
        surfaces = "".join(f" --assign {name}={text}" for name, text in args.materials)
        print(f"{names}: for mitsuba-diffraction render {args.scene}{surfaces} --plan {names}")
    return report


def _planned(
    args: argparse.Namespace, load: Callable[[], Any], tell: Progress
) -> list[PlannedTable]:

    tell(0, 0, "tracing paths")
    tables = light_of_tables(load, partial(sensor_of, index=args.sensor), args.paths)
    tell(0, 0, "building tables")
    return [plan_table(table, args.plan_tolerance) for table in tables]


def load_by_plan(
    args: argparse.Namespace, variant: str, load: Callable[[], Any], tell: Progress
) -> Any:
    """Load a scene with the tables of a plan, in the variant that is set.

    Raises a DiffractionError if a recipe is for other surfaces.
    """
    if "spectral" not in variant:
        say_warning(
            f"--plan: {variant} looks up a table of colours or one wavelength, which a plan does "
            "not make smaller; rendering without one"
        )
        return load()
    if args.plan:
        return load_by_recipes(load, args.plan)
    try:
        planning_variant(variant if variant.startswith(("llvm", "cuda")) else None)
        planned = _planned(args, load, tell)
    finally:
        set_variant(variant)
    for table in planned:
        names, before = ", ".join(table.light.surfaces), table.light.table.nbytes / 1e6
        if table.settings is None:
            say(f"plan: {names} keeps its whole table of {before:.3g} MB")
        else:
            say(
                f"plan: {names} has a table of {table.table.nbytes / 1e6:.3g} MB instead of "
                f"{before:.3g} MB; at most {100 * table.outside:.2g} % of the surface's light lies "
                "beyond it, and is missing"
            )
    return load_limited(load, planned)


def check_plan_options(args: argparse.Namespace) -> None:
    """Refuse options of a plan where no plan is made, with a usage error."""
    made = ("paths", "plan_tolerance")
    if args.plan is None:
        options.refuse(args, made, ": is for --plan, which is missing")
    elif args.plan:
        options.refuse(
            args, made, ": has no effect on the recipes of --plan; leave one of both out"
        )
