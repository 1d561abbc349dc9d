"""`mitsuba-diffraction solve`: from a groove's profile, or a file of efficiencies, to orders."""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..atomic import make_folder
from ..errors import DiffractionError, counted
from ..heights import HeightField, LoadOptions
from ..heights.read import read_heights
from . import options
from .console import Bar, say
from .report import Figures, check_outputs, output_of
from .values import limits, number_between, numbers, path_ending_in, value, whole_number
from .workers import WORKERS, calls_for

if TYPE_CHECKING:
    from ..orders import OrderTable
    from ..orders.solve.films import Layers
    from ..orders.solve.recipes import SolvedRecipe
    from ..orders.solve.settings import Estimate

#: Options of an imported file.
_IMPORTED = ("source", "output", "period", "period_y", "superstrate", "imports")
#: Options that override fields of a recipe.
_OF_A_RECIPE = (
    "material", "superstrate", "thin", "block", "output", "substrate", "layers", "beneath",
)  # fmt: skip
#: Options that override settings of a recipe.
_SETTINGS = ("wavelengths", "tolerance", "method", "resolution", "polarised")


def _layer(text: str) -> Layers:
    if text.endswith(".toml"):
        from ..orders.solve.films import read_layers

        return read_layers(text)
    material, colon, thickness = text.rpartition(":")
    return ((material, float(thickness if colon else "")),)


_LAYERS = value("MATERIAL:THICKNESS in µm, such as 1.46:0.1, or a file (.toml)", _layer)


@options.command(
    "solve", "solve the orders of a periodic profile rigorously",
    "Solve Maxwell's equations for a grating and write the efficiencies of its reflected "
    "orders, and a thin sheet's transmitted ones, for all directions and wavelengths, as a "
    "table of the BSDF diffraction_orders. "
    "Interrupted by Ctrl-C, the same command goes on.",
    ("SOURCE", "lamellar, blazed or sinusoidal; a line of one period (CSV of x, z in µm, "
     "undercut allowed); a recipe (.toml); with --import a file of efficiencies"),
    ("-o --output OUT", "the table; default: SOURCE's name with .nc",
     path_ending_in(".nc")),
    options.Group("the grating", (
        ("--period D", "µm", number_between(0.01, 1000)),
        ("--crossed", "SOURCE is one period of heights in x and y: an array (.npy) in µm, or an "
         "image with --depth from black to white; needs --period; reflection in air, for "
         "dielectrics; default of --material: 1.5", bool),
        ("--period-y D", "µm, of a crossed grating, along y; default: --period",
         number_between(0.01, 1000)),
        ("--depth H", "µm, of a generator", number_between(0, 100)),
        ("--duty F", "ridge, lamellar", number_between(0, 1)),
        ("--direction", "towards +x, blazed", ("descending", "ascending")),
        ("--material M", "conductor that Mitsuba knows, index such as 1.5 or 0.65+5.6i, a file of "
         "refractiveindex.info (.csv, .yml), a glass of a catalogue (schott.agf:N-BK7), or none "
         "(reflects all); default: Al"),
        ("--superstrate N", "index of the clear medium above the grooves, e.g. 1.58 under "
         "polycarbonate; default: 1", number_between(1, 5)),
        ("--layer M:T", "film on the grooves, material and thickness along z in µm, e.g. 1.46:0.1; "
         "once for each, from the material upwards", [_LAYERS], None, {"dest": "layers"}),
        ("--beneath M:T", "layer beneath the grooves, or a file of layers and slices (.toml); once "
         "for each, from the substrate upwards", [_LAYERS]),
        ("--substrate M", "material below them; default: --material"),
        ("--thin", "a thin sheet that light goes through, with these grooves on its upper side; "
         "needs an index as material", bool),
        ("--block", "a clear block with these grooves on its upper face, in light from above and "
         "from within; needs an index as material; solved by coupled waves", bool),
    )),
    options.Group("the table", (
        ("--wavelength-range FIRST:LAST", "nm; default: 380:780", limits, None,
         {"dest": "wavelengths"}),
        ("--tolerance E", "mean error between nodes, of the light in all orders but 0; 95 %% of "
         "directions keep 4 times as much; default: 0.01", number_between(1e-4, 0.2)),
        ("--solver", "Chandezon's method, for slopes; boundary integral (extra solve); coupled "
         "waves, for dielectrics; default: auto, the first that suits",
         ("auto", "chandezon", "integral", "coupled"), None, {"dest": "method"}),
        ("--resolution N", "points on the boundary, or harmonics; default: chosen by convergence",
         whole_number(3)),
        ("--polarised", "with Mueller matrices, for polarised variants; about 20 times as large",
         bool),
        ("--theta DEG", "solve light from these directions alone, angles from the normal within "
         "the superstrate, e.g. 63.4, or --theta=-20:20:5: for an echelle in its mount",
         numbers),
        ("--phi DEG", "with --theta: azimuths from x, across the grooves, towards y; default: 0",
         numbers),
        ("--step NM", "with --theta or --crossed: between wavelengths; default: 5, of all "
         "directions of crossed gratings 20", number_between(0.01, 1000)),
        ("--import", "SOURCE holds efficiencies of another program or a bench: a long CSV of "
         "wavelength_nm, theta_deg, phi_deg, order, R_s, R_p, or NetCDF, of one angle of incidence "
         "or more; order_x, order_y for order make a crossed grating; needs --period", bool, None,
         {"dest": "imports"}),
    )),
    options.retired_row("accept", bool),
    ("--jobs N", "processes here; default: 1", whole_number(1)),
    WORKERS,
    options.json("the table's summary"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Solve, write the table, and return the figures.

    A table that misses its tolerance is written, and the exit code is 1.
    """
    from ..orders.file import load_orders
    from ..orders.solve.accuracy import missed_tolerance

    source = Path(args.source)
    if args.imports:
        from ..orders.imported import read_orders

        if args.period is None:
            args.parser.error("argument --import: needs --period, µm")
        options.refuse_others(args, _IMPORTED, ": is for a solution; --import has efficiencies")
        output = output_of(args, Path(f"{source.stem}.nc"))
        period = (args.period, args.period_y) if args.period_y else args.period
        table: OrderTable = read_orders(source, period, superstrate=args.superstrate or 1.0)
    else:
        recipe = recipe_of(args)
        output = recipe.output
        # the folder that a recipe names is made
        check_outputs([output], make_folder=args.output is None)
        if args.output is None:
            make_folder(output.parent)
        table = solve_recipe(recipe, args)
    table.save(output)
    measured, table = table.digest(), load_orders(output)
    if table.digest() != measured:
        raise DiffractionError(f"'{output}' is not what was solved; is the disk damaged?")
    if missed_tolerance(table.header):
        args.code = 1
    print(f"{args.source} -> {output}")
    for label, text in _report(table, output):
        print(f"  {label:<11} {text}")
    return {"file": str(output), **table.summary()}


def recipe_of(args: argparse.Namespace) -> SolvedRecipe:
    """Return the problem of a recipe and of the options that override it."""
    from ..orders.solve.recipes import SolvedRecipe, profile_of

    source, output = Path(args.source), Path(f"{Path(args.source).stem}.nc")
    shape = options.given(args, ("period", "depth", "duty", "direction"))
    if args.crossed:
        options.refuse(args, ("duty", "direction"), ": not allowed with --crossed")
        recipe = SolvedRecipe(_unit_cell(source, args), output, "1.5")
    else:
        options.refuse(args, ["period_y"], ": profiles are one-dimensional; add --crossed")
        if source.suffix.lower() in (".nc", ".h5", ".hdf5"):
            args.parser.error(
                f"argument SOURCE: '{source}' holds no profile; for efficiencies add --import"
            )
        if source.suffix.lower() == ".toml":
            options.refuse(args, shape, ": the recipe has the profile")
            recipe = SolvedRecipe.load(source)
        else:
            profile = profile_of(args.source, shape)
            recipe = SolvedRecipe(profile, output)
    changed = options.given(args, _OF_A_RECIPE)
    for name in ("layers", "beneath"):
        if name in changed:
            changed[name] = tuple(itertools.chain(*changed[name]))
    settings = options.given(args, _SETTINGS)
    return replace(recipe, settings=replace(recipe.settings, **settings), **changed)


def _unit_cell(source: Path, args: argparse.Namespace) -> HeightField:
    """Read one period of heights in x and y."""
    if args.period is None:
        args.parser.error("argument --crossed: needs --period, µm")
    cell = read_heights(
        source,
        LoadOptions(pixel_size=(1.0, 1.0), max_height=args.depth, level="none", periodic="exact"),
    )
    rows, columns = cell.heights.shape
    sizes = args.period / columns, (args.period_y or args.period) / rows
    return replace(cell, pixel_size=sizes)


def solve_recipe(recipe: SolvedRecipe, args: argparse.Namespace) -> OrderTable:
    """Solve a recipe on the requested processes; partial solutions are stored beside the output."""
    from ..orders.solve.accuracy import WORST
    from ..orders.solve.jobs import Jobs, remove_results
    from ..orders.solve.orders import solve_orders

    light: dict[str, Any] = {}
    if args.theta is not None:
        light = {"theta": args.theta, "phi": args.phi or 0.0}
    else:
        options.refuse(args, ["phi"], ": only with --theta")
        if not args.crossed:
            options.refuse(args, ["step"], ": only with --theta or --crossed")
    tolerance = recipe.settings.tolerance
    limits = (
        f"; tolerance: {tolerance:.2%} of the light in orders on average, {WORST * tolerance:.2%} "
        "in 95 % of directions"
    )
    folder = recipe.output.with_name(f".{recipe.output.stem}.solving")
    with calls_for(args) as (calls, processes), Bar(args, " stations") as bar:

        def announce(estimate: Estimate) -> None:
            size = f" for a table of {estimate.size / 1e6:.2g} MB" if estimate.size else ""
            say(
                f"{estimate.stage}: {counted(estimate.solutions, 'solution')} at "
                f"{counted(estimate.stations, 'station')}, about "
                f"{_time(estimate.seconds / processes)}{size}; results are kept "
                f"in '{folder}'{limits}"
            )

        table = solve_orders(
            **recipe.arguments(),
            **light,
            step=args.step,
            jobs=Jobs(folder, calls, bar),
            announce=announce,
        )
    remove_results(folder)
    return table


def _report(table: OrderTable, output: Path) -> Iterator[tuple[str, str]]:
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
    yield "table", f"{table.response.layout}, {size:.2g} MB on disk"
    if "error_mean" in facts:
        yield (
            "error",
            (
                f"{facts['error_mean']:.2%} of the light in orders on average, at most "
                f"{facts['error_worst']:.2%} in 95 % of directions"
            ),
        )
        if table.polarised and "error_polarised" in facts:
            yield "", f"{facts['error_polarised']:.2%} with its polarisation"
        yield (
            "",
            f"of a single order, relative: {facts['error_relative']:.2g} in 95 %, at most "
            f"{facts['error_largest']:.2g} ({facts['error_place']})",
        )
    if "reciprocity_error" in facts:
        yield "reciprocity", f"kept within {facts['reciprocity_error']:.2g} of the light"
    if "energy_error" in facts:
        yield "energy", f"R + T is 1 within {facts['energy_error']:.2g} on average"


def _time(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
