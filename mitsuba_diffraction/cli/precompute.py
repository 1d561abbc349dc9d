"""`mitsuba-diffraction precompute`: from heights to a table."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..atomic import make_folder
from ..cluster.jobs import WorkerCalls
from ..errors import counted, warn
from ..files import FileKind, kind_of
from ..heights import HeightField
from ..system import peak_memory
from ..tables import DiffractionTable, TableSource
from ..tables.build.build import build_with
from ..tables.build.checks import warnings_of
from . import options
from .console import Bar
from .report import Figures, check_outputs, output_of
from .values import path_ending_in
from .workers import WORKERS, client_of


@options.command(
    "precompute", "build the table of a height field",
    "Build a table of diffraction orders from measured or generated heights, and measure its "
    "error. Options override the settings of a recipe.",
    ("SOURCE ...", "image, array, text, AFM file or recipe (.toml); several patches of one "
     "surface make one table of their mean powers, several recipes make a table each", Path,
     None, {"dest": "sources"}),
    ("-o --output OUT", "the table; default: where the recipe says, or else SOURCE's name with "
     ".exr in the current folder", path_ending_in(".exr")),
    options.heights(),
    options.Group("the table", (
        *options.table(), *options.table(("wavelength_range",)),
        options.retired_row("second_order"),
    )),
    WORKERS,
    options.json("the table's summary"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Build the table of each recipe, and return the figures."""
    how = options.load_options(args)
    recipes = [source for source in args.sources if kind_of(source) is FileKind.RECIPE]
    if recipes and len(recipes) < len(args.sources):
        args.parser.error("argument SOURCE: recipes and other files cannot be mixed")
    if len(recipes) > 1 and args.output is not None:
        args.parser.error("argument -o/--output: one name, but there are several recipes")
    if not recipes and len(args.sources) > 1 and args.output is None:
        args.parser.error("argument -o/--output: name the one table of these files")
    tables = recipes or [args.sources]
    summaries = [_precompute(args, TableSource.of(files, how)) for files in tables]
    return summaries[0] if len(summaries) == 1 else {"tables": summaries}


def _precompute(args: argparse.Namespace, source: TableSource) -> dict[str, Any]:
    """Build one table and return its summary; the folder of a recipe's output may be made."""
    start = time.perf_counter()
    settings = source.settings_for(options.table_options(args))
    of_recipe = source.kind is FileKind.RECIPE
    is_new = of_recipe and args.output is None
    if not of_recipe:
        output = output_of(args, source.output)
    else:
        output = args.output or source.output
        check_outputs([output], make_folder=is_new)
    with Bar(args) as bar:
        bar(0, 0, "making heights")
        fields = source.fields()
    for line in warnings_of(fields, settings):  # before the minutes that the table takes
        warn(line)
    with client_of(args) as client, Bar(args) as bar:
        calls = None if client is None else WorkerCalls(client)
        table = build_with(fields, settings, bar, calls or map)
        if is_new:
            make_folder(output.parent)
        table.save(output)
    given = [source.path] if of_recipe else source.files
    print(f"{', '.join(map(str, given))} -> {output}")
    for label, text in _report(fields, table, output, time.perf_counter() - start):
        print(f"  {label:<6} {text}")
    figures = {"file": str(output), **table.summary()}
    if calls is not None:
        work = calls.report
        print(
            f"  work   {counted(work.tasks, 'task')} of windows, {work.retries} given out again, "
            f"{work.busy:.1f} s of workers' work"
        )
        figures["workers"] = {"tasks": work.tasks, "retries": work.retries, "busy": work.busy}
    return figures


def _report(
    fields: Sequence[HeightField], table: DiffractionTable, output: Path, seconds: float
) -> Iterator[tuple[str, str]]:
    """Yield lines on the patch, the table, its error and its cost, each with its label."""
    for field in fields:
        (ny, nx), (dx, dy), (lx, ly) = field.shape, field.pixel_size, field.extent
        patch = (
            f"{field.name}: {nx} x {ny} pixels of {dx:.4g} x {dy:.4g} µm, "
            f"{lx:.4g} x {ly:.4g} µm; range {field.range:.4g} µm, "
            f"RMS height {field.rms_height:.4g} µm, RMS slope {field.rms_slope:.3g}"
        )
        yield "patch", patch
        for line in field.history:
            yield "", line
    yield "window", table.source["window"]
    if "windows" in table.source:
        windows = table.source["windows"]
        width, height = windows["extent"]
        if windows["number"] == 1:
            yield "", f"one window of {width:.4g} x {height:.4g} µm, which fades towards its edges"
        else:
            error = windows["standard_error"]
            yield (
                "",
                (
                    f"mean of {counted(windows['number'], 'window')} of {width:.4g} x "
                    f"{height:.4g} µm; its standard error is "
                    f"{error['glossy']:.2g} of the light near order 0, and "
                    f"{error['colours']:.2g} of that of all other orders"
                ),
            )
    if "variation" in table.source:
        yield "", f"orders vary by {table.source['variation']:.2g} of their mean between patches"
    intervals, ny, nx, _, terms = table.coefficients.shape
    size = (
        f"{nx} x {ny} orders, {counted(terms, 'term')} in {counted(intervals, 'interval')} of κ, "
        f"{' x '.join(map(str, table.grid.taps))} taps; "
        f"{table.expansion.basis} {table.expansion.kind}, {table.coefficients.dtype}, "
        f"{table.nbytes / 1e6:.3g} MB in memory, {output.stat().st_size / 1e6:.3g} MB on disk"
    )
    yield "table", size
    error = (
        f"measured {table.error['near']:.2g} near order 0, {table.error['far']:.2g} in all "
        f"other orders; tolerance {table.tolerance:g}"
    )
    yield "error", error
    # of the whole process, which has to fit
    yield "cost", f"{seconds:.1f} s, {peak_memory() / 1e9:.2g} GB of memory at most"
