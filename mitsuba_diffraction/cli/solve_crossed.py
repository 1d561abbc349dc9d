"""`mitsuba-diffraction solve --crossed`: orders of one period of heights in x and y."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from . import options
from .console import Bar, say
from .workers import executor_for

if TYPE_CHECKING:
    from ..orders import OrderTable

#: Options that crossed gratings do not have.
_GROOVES_ONLY = (
    "duty", "direction", "superstrate", "layers", "beneath", "substrate", "thin", "block",
    "tolerance", "solver", "polarised", "theta", "phi", "imports",
)  # fmt: skip


def solve_crossed_cell(source: Path, output: Path, args: argparse.Namespace) -> OrderTable:
    """Solve a crossed grating."""
    from ..heights.read import LoadOptions, read_heights
    from ..orders.solve.crossed import solve_crossed
    from ..orders.solve.jobs import remove_results

    options.refuse(args, _GROOVES_ONLY, ": not allowed with --crossed")
    if args.period is None:
        args.parser.error("argument --crossed: needs --period, µm")
    cell = read_heights(
        source,
        LoadOptions(pixel_size=(1.0, 1.0), max_height=args.depth, level="none", periodic="exact"),
    )
    rows, columns = cell.heights.shape
    sizes = args.period / columns, (args.period_y or args.period) / rows
    if abs(sizes[0] / sizes[1] - 1.0) > 1e-6:
        args.parser.error(
            f"argument --period-y: '{source}' has {columns} x {rows} pixels, which are not square "
            "over these periods"
        )
    limits = args.wavelength_range or (380.0, 780.0)
    folder = output.with_name(f".{output.stem}.solving")
    say(f"results are kept in '{folder}'")
    with executor_for(args) as (executor, _), Bar(args, " directions") as bar:
        table = solve_crossed(
            replace(cell, pixel_size=sizes[0]),
            1.5 if args.material is None else args.material,
            wavelengths=limits,
            step=args.step or 20.0,
            harmonics=args.resolution or 0,
            executor=executor,
            folder=folder,
            progress=bar,
        )
    remove_results(folder)
    return table
