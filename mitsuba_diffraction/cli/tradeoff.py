"""`mitsuba-diffraction tradeoff`: accuracy against speed and memory."""

from __future__ import annotations

import argparse
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..analysis.machine import describe_machine
from ..analysis.timing import PIXEL
from ..analysis.tradeoff import (
    Budget,
    measure,
    measure_depths,
    measure_wavelengths,
    recommended,
    settings,
)
from ..analysis.tradeoff.accuracy import Sample
from ..analysis.tradeoff.report import draw_depths, draw_trade, lines, plain
from ..atomic import make_folder
from ..columns import save_rows
from ..errors import DiffractionWarning
from ..heights import Source, gratings
from ..heights.coherence import resolved_width
from ..scene import set_variant
from ..tables import DiffractionTable
from . import options
from .console import Bar
from .report import Figures, output_of, save_json
from .values import number_between

#: Pixels of the default patch along an axis, pairs of directions, calls in a kernel launch, timed
#: launches, height scales.
FULL, QUICK = (1332, 240, 1 << 19, 7, 14), (400, 160, 1 << 17, 5, 9)


@options.command(
    "tradeoff", "measure accuracy against speed and memory, setting by setting",
    "Build a patch's table with many settings and measure each: its error against the "
    "integral in double precision, the colours' ΔE2000, the time of eval beside "
    "roughconductor, memory and build time. Writes the figures as CSV and JSON, a plot of "
    "error against time, and one of error against depth; recommends a setting.",
    ("-o --output FOLDER", "where files go; default: tradeoff", Path),
    ("--quick", "fewer settings, a smaller patch", bool),
    *options.table(["coherence_width"]),
    options.Group("recommend a setting with", (
        ("--max-error E", "largest measured error; default: 1e-3", number_between(0, 1)),
        ("--memory MB", "largest table", number_between(0, 1e6)),
        ("--time X", "longest time of eval, as a multiple of roughconductor's",
         number_between(0, 1e6)),
    )),
    options.json(),
    ("HEIGHTS", "patch to measure, from any file of heights; default: "
     "gratings.elaphe_like", Path, None, {"nargs": "?"}),
    options.heights(),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Measure, write and recommend, and return the figures."""
    if args.heights is None:
        options.refuse(args, options.HEIGHTS, ": needs a file of HEIGHTS; name one")
    args.output = output_of(args, Path("tradeoff"), _files_in, make_folder=True)
    side, pairs, lanes, rounds, depths = QUICK if args.quick else FULL
    if args.heights is None:
        field = gratings.elaphe_like(side * PIXEL, side)
    else:
        field = Source.of(args.heights, options.load_options(args)).field()
    width = resolved_width(options.table_options(args).get("coherence_width", "auto"), [field])
    set_variant("llvm_ad_spectral")
    quiet = warnings.catch_warnings(action="ignore", category=DiffractionWarning)  # `info` has them
    with Bar(args) as bar, quiet:
        results = measure(
            field,
            list(settings(args.quick)),
            coherence_width=width,
            pairs=pairs,
            lanes=lanes,
            rounds=rounds,
            progress=bar,
        )
        budget = Budget(args.max_error, args.memory, args.time)
        if budget == Budget():
            budget = Budget(1e-3)
        best = recommended(results, budget)
        finest = DiffractionTable.build(field, coherence_width=width, tolerance=1e-4)
        sample = Sample.draw(field, width, "ensemble", min(pairs, 160), bar)
        spectral = measure_wavelengths(finest, *sample.pairs[:2])
        deep = measure_depths(depths, bar)
    make_folder(args.output)
    title = (
        f"{field.name}, {field.heights.shape[1]} × {field.heights.shape[0]} pixels, {width:g} µm"
    )
    draw_trade(results, args.output / "tradeoff.png", title)
    draw_depths(deep, args.output / "depth.png")
    document: dict[str, Any] = {
        "patch": title,
        "machine": describe_machine(),
        "recommended": {"setting": best.setting.name, "budget": asdict(budget)},
        "spectral": asdict(spectral),
    }
    document |= plain(results, deep)
    save_json(args.output / "tradeoff.json", document)
    names = [name for name in document["settings"][0] if name != "arguments"]
    save_rows(args.output / "tradeoff.csv", names, document["settings"])
    print("\n".join(lines(results, spectral, best, budget)))
    print(f"wrote {args.output / 'tradeoff'}.json, .csv, .png and depth.png")
    return document


def _files_in(folder: Path) -> list[Path]:
    names = ("tradeoff.json", "tradeoff.csv", "tradeoff.png", "depth.png")
    return [folder / name for name in names]
