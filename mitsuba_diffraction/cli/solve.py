"""`mitsuba-diffraction solve`: from a groove's profile, or a file of efficiencies, to orders."""

from __future__ import annotations

import argparse
import functools
import itertools
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import options
from .console import Bar, say
from .options import number_between, whole_number
from .report import check_outputs, save_report
from .solve_crossed import solve_crossed_cell
from .workers import add_workers, executor_for

if TYPE_CHECKING:
    from ..solve.films import Layers
    from ..solve.orders import Estimate
    from ..solve.recipes import SolvedRecipe
    from ..tables.orders import CrossedTable, OrderTable

#: Options that an imported file does not have.
_SOLVED_ONLY = (
    "depth", "duty", "direction", "material", "layers", "beneath", "substrate", "thin", "block",
    "wavelength_range", "tolerance", "solver", "resolution", "polarised", "accept", "theta", "phi",
    "step", "jobs", "workers", "scheduler",
)  # fmt: skip


def add_parser(subparsers: options.Subparsers) -> None:
    parser = options.add_command(
        subparsers, "solve", run, "solve the orders of a periodic profile rigorously",
        "Solve Maxwell's equations for a grating and write the efficiencies of its reflected "
        "orders, and a thin sheet's transmitted ones, for all directions and wavelengths, as a "
        "table of the BSDF diffraction_orders. "
        "Interrupted by Ctrl-C, the same command goes on.",
    )  # fmt: skip
    parser.add_argument(
        "source", metavar="SOURCE",
        help="lamellar, blazed or sinusoidal; a line of one period (CSV of x, z in µm, undercut "
        "allowed); a recipe (.toml); with --import a file of efficiencies",
    )  # fmt: skip
    options.add_output(parser, "the table; default: SOURCE's name with .nc", ".nc")
    group = parser.add_argument_group("the grating")
    group.add_argument("--period", metavar="D", type=number_between(0.01, 1000), help="µm")
    group.add_argument(
        "--crossed", action="store_true", default=None,
        help="SOURCE is one period of heights in x and y: an array (.npy) in µm, or an image with "
        "--depth from black to white; needs --period; reflection in air, by ikarus-rcwa (extra "
        "crossed), for dielectrics",
    )  # fmt: skip
    group.add_argument(
        "--period-y", metavar="D", type=number_between(0.01, 1000),
        help="µm, of a crossed grating, along y; default: --period",
    )  # fmt: skip
    group.add_argument(
        "--depth", metavar="H", type=number_between(0, 100), help="µm, of a generator"
    )
    group.add_argument("--duty", metavar="F", type=number_between(0, 1), help="ridge, lamellar")
    group.add_argument(
        "--direction", choices=("descending", "ascending"), help="towards +x, blazed"
    )
    group.add_argument(
        "--material", metavar="M",
        help="conductor that Mitsuba knows, index such as 1.5 or 0.65+5.6i, or none (reflects "
        "all); default: Al",
    )  # fmt: skip
    group.add_argument(
        "--superstrate", metavar="N", type=number_between(1, 5),
        help="index of the clear medium above the grooves, e.g. 1.58 under polycarbonate; "
        "default: 1",
    )  # fmt: skip
    group.add_argument(
        "--layer", metavar="M:T", type=_layer, action="append", dest="layers",
        help="film on the grooves, material and thickness along z in µm, e.g. 1.46:0.1; once for "
        "each, from the material upwards",
    )  # fmt: skip
    group.add_argument(
        "--beneath", metavar="M:T", type=_layer, action="append",
        help="layer beneath the grooves, or a file of layers and slices (.toml); once for each, "
        "from the substrate upwards",
    )  # fmt: skip
    group.add_argument("--substrate", metavar="M", help="material below them; default: --material")
    group.add_argument(
        "--thin", action="store_true", default=None,
        help="a thin sheet that light goes through, with these grooves on its upper side; needs an "
        "index as material",
    )  # fmt: skip
    group.add_argument(
        "--block", action="store_true", default=None,
        help="a clear block with these grooves on its upper face, in light from above and from "
        "within; needs an index as material; solved by coupled waves",
    )  # fmt: skip
    group = parser.add_argument_group("the table")
    group.add_argument("--wavelength-range", metavar="A,B", type=_pair, help="nm; default: 380,780")
    group.add_argument(
        "--tolerance", metavar="E", type=number_between(1e-4, 0.2),
        help="mean error between nodes, of the light in all orders but 0; 95 %% of directions keep "
        "4 times as much; default: 0.01",
    )  # fmt: skip
    group.add_argument(
        "--accept", action="store_true", default=None,
        help="write a table that misses the tolerance, too, with its error",
    )  # fmt: skip
    group.add_argument(
        "--solver", choices=("auto", "chandezon", "integral", "coupled"),
        help="Chandezon's method, for slopes; boundary integral (extra solve); coupled waves, for "
        "dielectrics; default: auto, the first that suits",
    )  # fmt: skip
    group.add_argument(
        "--resolution", metavar="N", type=whole_number(4),
        help="points on the boundary, or harmonics; default: chosen by convergence",
    )  # fmt: skip
    group.add_argument(
        "--polarised", action="store_true", default=None,
        help="with Mueller matrices, for polarised variants; about 20 times as large",
    )  # fmt: skip
    group.add_argument(
        "--theta", metavar="DEG", type=options.numbers,
        help="solve light from these directions alone, angles from the normal within the "
        "superstrate, e.g. 63.4, or --theta=-20:20:5: for an echelle in its mount",
    )  # fmt: skip
    group.add_argument(
        "--phi", metavar="DEG", type=options.numbers,
        help="with --theta: azimuths from x, across the grooves, towards y; default: 0",
    )  # fmt: skip
    group.add_argument(
        "--step", metavar="NM", type=number_between(0.01, 1000),
        help="with --theta: between wavelengths; default: 5",
    )  # fmt: skip
    group.add_argument(
        "--import", dest="imports", action="store_true",
        help="SOURCE holds efficiencies of another program or a bench: a long CSV of "
        "wavelength_nm, theta_deg, phi_deg, order, R_s, R_p, or NetCDF, of one angle of "
        "incidence or more; order_x, order_y for order make a crossed grating; needs --period",
    )  # fmt: skip
    parser.add_argument(
        "--jobs", metavar="N", type=whole_number(1),
        help="processes here; default: 1",
    )  # fmt: skip
    add_workers(parser)
    options.add_json(parser, "the table's summary")


def run(args: argparse.Namespace) -> int:
    """Solve, write the table, and return the exit code."""
    source = Path(args.source)
    output = args.output or Path(f"{source.stem}.nc")
    if args.imports:
        from ..solve.measured import read_orders

        _check_import(args)
        check_outputs([output], [source], "table")
        period = (args.period, args.period_y) if args.period_y else args.period
        table: OrderTable | CrossedTable = read_orders(
            source, period, superstrate=args.superstrate or 1.0
        )
    elif args.crossed:
        check_outputs([output], [source], "table")
        table = solve_crossed_cell(source, output, args)
    else:
        recipe = recipe_of(args)
        output = recipe.output
        # the folder that a recipe names is made
        check_outputs([output], [source], "table", make_folder=args.output is None)
        if args.output is None:
            output.parent.mkdir(parents=True, exist_ok=True)
        table = solve_recipe(recipe, args)
    table.save(output)
    print(f"{args.source} -> {output}")
    for label, text in _report(table, output):
        print(f"  {label:<11} {text}")
    save_report(args, {"file": str(output), **table.summary()})
    return 0


def _check_import(args: argparse.Namespace) -> None:
    """Refuse an import without its period, or with options of a solution."""
    if args.period is None:
        args.parser.error("argument --import: needs --period, µm")
    for name in _SOLVED_ONLY:
        if getattr(args, name) is not None:
            option = name.replace("_", "-")
            args.parser.error(f"argument --{option}: is for a solution; --import has efficiencies")


def recipe_of(args: argparse.Namespace) -> SolvedRecipe:
    """Return the problem of a recipe and of the options that override it."""
    from ..solve.orders import Settings
    from ..solve.recipes import SolvedRecipe, profile_of

    source = Path(args.source)
    if args.period_y is not None:
        args.parser.error("argument --period-y: profiles are one-dimensional; add --crossed")
    shape = {
        name: value
        for name in ("period", "depth", "duty", "direction")
        if (value := getattr(args, name)) is not None
    }
    if source.suffix.lower() == ".toml":
        if shape:
            args.parser.error(f"argument --{next(iter(shape))}: the recipe has the profile")
        recipe = SolvedRecipe.load(source)
    else:
        if source.suffix.lower() in (".nc", ".h5", ".hdf5"):
            args.parser.error(
                f"argument SOURCE: '{source}' holds no profile; for efficiencies add --import"
            )
        profile = profile_of(args.source, shape)
        recipe = SolvedRecipe(profile, "Al", 1.0, False, Settings(), Path(f"{source.stem}.nc"))
    changed = {
        field: value
        for field, value in (
            ("wavelengths", args.wavelength_range), ("tolerance", args.tolerance),
            ("method", args.solver), ("resolution", args.resolution),
            ("polarised", args.polarised), ("accept", args.accept),
        )
        if value is not None
    }  # fmt: skip
    return replace(
        recipe,
        material=recipe.material if args.material is None else args.material,
        superstrate=recipe.superstrate if args.superstrate is None else args.superstrate,
        thin=recipe.thin or bool(args.thin),
        block=recipe.block or bool(args.block),
        settings=replace(recipe.settings, **changed),
        output=args.output or recipe.output,
        substrate=recipe.substrate if args.substrate is None else args.substrate,
        layers=_chained(args.layers, recipe.layers),
        beneath=_chained(args.beneath, recipe.beneath),
    )


def solve_recipe(recipe: SolvedRecipe, args: argparse.Namespace) -> OrderTable:
    """Solve a recipe on the requested processes; partial solutions are stored beside the output."""
    from ..solve.accuracy import WORST
    from ..solve.beam import solve_beam
    from ..solve.block import solve_block
    from ..solve.jobs import Jobs
    from ..solve.orders import solve_orders

    medium: dict[str, Any] = {
        name: getattr(recipe, name) for name in ("superstrate", "layers", "beneath", "substrate")
    }
    solve: Callable[..., OrderTable] = functools.partial(solve_orders, thin=recipe.thin, **medium)
    if recipe.block:
        _check_block(recipe, args)
        solve = solve_block
    elif args.theta is not None:
        _check_beam(recipe, args)
        light: dict[str, Any] = {
            "theta": args.theta,
            "phi": args.phi or 0.0,
            "step": args.step or 5.0,
        }
        solve = functools.partial(solve_beam, **light, **medium)
    elif args.phi is not None or args.step is not None:
        args.parser.error("arguments --phi, --step: only with --theta")
    tolerance = recipe.settings.tolerance
    limits = (
        f"; tolerance: {tolerance:.2%} of the light in orders on average, {WORST * tolerance:.2%} "
        "in 95 % of directions"
    )
    folder = recipe.output.with_name(f".{recipe.output.stem}.solving")
    with executor_for(args) as (executor, processes), Bar(args, " stations") as bar:

        def announce(estimate: Estimate) -> None:
            say(
                f"{estimate.stage}: {estimate.solutions} solutions at {estimate.stations} "
                f"stations, about {_time(estimate.seconds / processes)}; results are kept in "
                f"'{folder}'{limits}"
            )

        table = solve(
            recipe.profile,
            recipe.material,
            settings=recipe.settings,
            jobs=Jobs(folder, executor, bar),
            announce=announce,
        )
    shutil.rmtree(folder, ignore_errors=True)
    return table


def _check_beam(recipe: SolvedRecipe, args: argparse.Namespace) -> None:
    """Refuse thin sheets and matrices with `--theta`, with a usage error."""
    for name, used in (("thin", recipe.thin), ("polarised", recipe.settings.polarised)):
        if used:
            args.parser.error(
                f"argument --theta: not allowed with --{name}: reflected shares alone"
            )


def _check_block(recipe: SolvedRecipe, args: argparse.Namespace) -> None:
    """Refuse what blocks do not have, with a usage error."""
    for name, used in (
        ("thin", recipe.thin), ("superstrate", recipe.superstrate != 1.0),
        ("layer", recipe.layers), ("beneath", recipe.beneath), ("substrate", recipe.substrate),
        ("theta", args.theta is not None),
    ):  # fmt: skip
        if used:
            args.parser.error(
                f"argument --block: not allowed with --{name}; the block's index is relative to "
                "the medium above"
            )


def _report(table: OrderTable | CrossedTable, output: Path) -> Iterator[tuple[str, str]]:
    """Yield lines on the table, each with its label."""
    facts: dict[str, Any] = dict(table.header)
    low, high = table.wavelengths
    medium = f" under index {table.superstrate:g}" if table.superstrate > 1 else ""
    medium = ", thin sheet" if table.thin else medium
    medium = ", block" if table.block else medium
    yield "grating", f"{facts['profile']}, {facts['material']}{medium}, {low:g} to {high:g} nm"
    yield "solver", str(facts["solver"])
    if facts.get("solver_error") is not None:
        yield "", f"its next resolution changes {facts['solver_error']:.2g} of the light"
    size = output.stat().st_size / 1e6
    yield "table", f"{table.layout}, {size:.2g} MB on disk"
    if "error_mean" in facts:
        yield (
            "error",
            (
                f"{facts['error_mean']:.2%} of the light in orders on average, at most "
                f"{facts['error_worst']:.2%} in 95 % of directions"
            ),
        )
        if table.polarised:
            yield "", f"{facts['error_polarised']:.2%} with its polarisation"
        yield "reciprocity", f"kept within {facts['reciprocity_error']:.2g} of the light"
    if "energy_error" in facts:
        yield "energy", f"R + T is 1 within {facts['energy_error']:.2g} on average"


def _pair(text: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"expected two numbers A,B, got '{text[:40]}'") from error
    return low, high


def _layer(text: str) -> Layers:
    if text.endswith(".toml"):
        from ..solve.films import read_layers

        return read_layers(text)
    material, _, thickness = text.rpartition(":")
    try:
        return ((material, float(thickness)),)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            "expected MATERIAL:THICKNESS in µm, such as 1.46:0.1, or a file (.toml), got "
            f"'{text[:40]}'"
        ) from error


def _chained(given: list[Layers] | None, default: Layers) -> Layers:
    """Return the layers of all uses of an option."""
    return default if given is None else tuple(itertools.chain(*given))


def _time(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
