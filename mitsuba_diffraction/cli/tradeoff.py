"""`mitsuba-diffraction tradeoff`: accuracy against speed and memory, measured."""

from __future__ import annotations

import argparse
import csv
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .arguments import number_between
from .heights_options import add_heights_options, load_options, was_given
from .output import check_writable
from .progress import Bar
from .report import save_json

if TYPE_CHECKING:
    from ..analysis.tradeoff.depth import Depths
    from ..analysis.tradeoff.measuring import Measured
    from ..analysis.tradeoff.wavelengths import Spectral

#: Pixels of the default patch, pairs of directions, calls at once, timed rounds, depths.
_FULL, _QUICK = (1332, 240, 1 << 19, 7, 14), (400, 160, 1 << 17, 5, 9)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "tradeoff",
        help="measure accuracy against speed and memory, setting by setting",
        description=(
            "Build a patch's table with many settings and measure each: its error against the "
            "integral in double precision, the colours' ΔE2000, the time of eval beside "
            "roughconductor, memory and build time. Writes the figures as CSV and JSON, a plot of "
            "error against time, and one of error against depth; recommends a setting."
        ),
    )
    parser.add_argument(
        "heights", metavar="HEIGHTS", type=Path, nargs="?",
        help="patch of any file of heights; default: gratings.elaphe_like",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", metavar="FOLDER", type=Path, default=Path("tradeoff"),
        help="where files go; default: tradeoff",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="fewer settings, a smaller patch")
    parser.add_argument(
        "--coherence-width", metavar="W", type=number_between(0.01, 1e5),
        help="µm; default: 65, or the default patch's width if that is less",
    )  # fmt: skip
    budget = parser.add_argument_group("recommend a setting with")
    budget.add_argument(
        "--tolerance",
        metavar="E",
        type=number_between(0.0, 1.0),
        help="an error of at most this; default: 1e-3",
    )
    budget.add_argument(
        "--memory", metavar="MB", type=number_between(0.0, 1e6), help="a table of at most this"
    )
    budget.add_argument(
        "--time", metavar="X", type=number_between(0.0, 1e6),
        help="an eval that takes at most X times as long as roughconductor's",
    )  # fmt: skip
    add_heights_options(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Measure, write and recommend, and return the exit code."""
    if args.heights is None and was_given(args):
        args.parser.error(f"{was_given(args)[0]} needs a file of heights")
    check_writable(args.output / "tradeoff.json", make_folder=True)
    from ..analysis.bench.machine import describe_machine
    from ..analysis.bench.plan import PIXEL
    from ..analysis.tradeoff import (
        Budget,
        measure,
        measure_depths,
        measure_wavelengths,
        recommended,
        settings,
    )
    from ..analysis.tradeoff.plot import draw_depths, draw_trade
    from ..analysis.tradeoff.sample import Sample
    from ..heights import gratings
    from ..heights.load import load_heights
    from ..scene.load import set_variant

    side, pairs, lanes, rounds, depths = _QUICK if args.quick else _FULL
    if args.heights is None:
        field = gratings.elaphe_like(side * PIXEL, side)
        width = args.coherence_width or min(65.0, side * PIXEL)
    else:
        field = load_heights(args.heights, load_options(args))
        width = args.coherence_width or 65.0
    set_variant("llvm_ad_spectral")
    with Bar(args) as bar:
        results = measure(
            field,
            list(settings(args.quick)),
            coherence_width=width,
            pairs=pairs,
            lanes=lanes,
            rounds=rounds,
            progress=bar,
        )
        best = recommended(results, Budget(*_budget(args).values()))
        from ..tables.table import DiffractionTable

        finest = DiffractionTable.build(field, coherence_width=width, tolerance=1e-4)
        sample = Sample.of(field, width, "ensemble", min(pairs, 160), bar)
        spectral = measure_wavelengths(finest, sample.wi, sample.wo)
        deep = measure_depths(depths, bar)
    args.output.mkdir(parents=True, exist_ok=True)
    title = (
        f"{field.name}, {field.heights.shape[1]} × {field.heights.shape[0]} pixels, {width:g} µm"
    )
    draw_trade(results, args.output / "tradeoff.png", title)
    draw_depths(deep, args.output / "depth.png")
    document = {
        "patch": title,
        "machine": describe_machine(),
        "recommended": {"setting": best.setting.name, "budget": _budget(args)},
        "spectral": asdict(spectral),
    }
    _write(args.output, document, results, deep)
    _say(results, spectral, best, args)
    return 0


def _budget(args: argparse.Namespace) -> dict[str, float | None]:
    """What is asked for; the default tolerance, if nothing is."""
    given = {"tolerance": args.tolerance, "megabytes": args.memory, "relative": args.time}
    if all(value is None for value in given.values()):
        given["tolerance"] = 1e-3
    return given


def _write(folder: Path, document: dict[str, Any], results: list[Measured], deep: Depths) -> None:
    from ..analysis.tradeoff.measuring import rows
    from ..atomic import atomic_path

    records = list(rows(results))
    document["settings"] = records
    document["depths"] = {
        "depth_um": deep.depth.tolist(),
        "errors": {name: values.tolist() for name, values in deep.errors.items()},
        "intervals": deep.intervals.tolist(),
    }
    save_json(folder / "tradeoff.json", document)
    with (
        atomic_path(folder / "tradeoff.csv") as path,
        path.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.DictWriter(file, [name for name in records[0] if name != "arguments"])
        writer.writeheader()
        for record in records:
            writer.writerow({k: v for k, v in record.items() if k != "arguments"})


def _say(
    results: list[Measured], spectral: Spectral, best: Measured, args: argparse.Namespace
) -> None:
    width = max(len(one.setting.name) for one in results)
    head = "  error  plugin's  ΔE2000    99 %  × roughconductor   taps  terms      MB   s"
    print(f"{'':<{width}} {head}")
    for one in results:
        name = f"{one.setting.name:<{width}}"
        if one.refused:
            print(f"{name}  {one.refused}")
            continue
        series = f"{one.intervals} × {one.terms}"
        print(
            f"{name} {one.error:7.1e}   {one.error_single:7.1e} {one.delta_e:7.3f} "
            f"{one.delta_e_99:7.2f} {one.relative:16.2f} {one.taps:6d} {series:>6} "
            f"{one.megabytes:7.2f} {one.seconds:3.1f}"
        )
    steps = ", ".join(f"{step:g} nm {error:.2f}" for step, error in spectral.steps.items())
    counts = ", ".join(f"{count} {noise:.2f}" for count, noise in spectral.counts.items())
    print(f"sums over the spectrum, ΔE2000: {steps}")
    print(f"wavelengths of a ray, noise of its luminance: {counts}")
    asked = ", ".join(f"{name} {value:g}" for name, value in _budget(args).items() if value)
    arguments = best.setting.arguments or {"": "the defaults"}
    said = ", ".join(f"{k}={v}" if k else str(v) for k, v in arguments.items())
    if best.setting.crop is not None:
        said += f", crop at {best.setting.crop:g} of all frequencies"
    print(
        f"recommended{f' ({asked})' if asked else ''}: {said}: error {best.error:.1e}, "
        f"{best.relative:.1f} × roughconductor, {best.megabytes:.1f} MB"
    )
    print(f"wrote {args.output / 'tradeoff'}.json, .csv, .png and depth.png")
