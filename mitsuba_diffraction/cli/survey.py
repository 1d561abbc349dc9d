"""`mitsuba-diffraction survey`: many scans, a row of measurements and a map each."""

from __future__ import annotations

import argparse
import contextlib
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..analysis.scans import check_surface
from ..analysis.treatments import Treatment, load_treatments
from ..errors import DiffractionError, counted
from ..heights.coherence import ONE_WINDOW
from ..scene.load import set_variant
from ..scene.parameters import files_of
from . import options
from .brdf_map import MATERIAL, surface_parameters
from .console import Bar, say
from .interrupt import keep_in_mind
from .report import Figures, elapsed, output_of
from .values import number_between, whole_number
from .workers import THREADS, WORKERS, client_of, say_files, worker_threads

# Ratio of the widths of scans from which on they are not compared.
_SIZES = 1.5


@options.command(
    "survey", "measure many scans: tables, maps, gratings, colours",
    "For each scan build its table, map its BRDF and measure its heights, the gratings in "
    "it, the colours that it shows and how much they change with direction. Writes "
    "survey.csv, samples.csv (means and standard errors of repeated scans), contact sheets, "
    "and a table and a map of each scan. A scan that fails is a row with its reason, and the "
    "command then exits with 1; a second run measures only new scans.",
    options.files("scans of any format, or recipes"),
    ("-o --output FOLDER", "default: survey", Path),
    options.TREATMENTS,
    ("--theta DEG", "angle of the light from the normal, across the strongest grating",
     number_between(0, 89), 30.0),
    ("--resolution N", "pixels of a map a side", whole_number(8), 160),
    ("--repeats", "scans of one sample: names that differ in their last number, or files of "
     "one folder", ("name", "folder"), "name"),
    ("--crops N", "number of crops of 10 µm of each scan, or as many as fit: compares scans "
     "of different sizes", whole_number(1)),
    options.MODE,
    options.Group("the surface, of maps and numbers", MATERIAL),
    options.heights(),
    options.Group("the tables", (*options.table(), options.retired_row("second_order"))),
    WORKERS,
    THREADS,
    options.json("the rows"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Measure new scans, and return the figures."""
    rows = _measured(args)
    for row in rows:
        if row["reason"]:
            say(f"{os.path.basename(row['file'])}: {row['reason']}")
    from ..analysis.iridescence import WINDOW

    done = [row for row in rows if not row["reason"]]
    wide = sorted(row["width_um"] for row in done)
    if wide and wide[-1] > _SIZES * max(wide[0], WINDOW):
        say(
            f"scans are {wide[0]:.3g} to {wide[-1]:.3g} µm wide: small ones have more colour by "
            "chance; compare them with --crops 4, crops of 10 µm"
        )
    scans = Counter(row["sample"] for row in done)
    if any(row["width_um"] <= ONE_WINDOW for row in done if scans[row["sample"]] == 1):
        say(
            "one index of a small scan is uncertain by some 15 %: its window sees one part of the "
            "surface; compare means of several scans of a sample (samples.csv)"
        )
    whole = sum("crop" not in row for row in done)
    if args.crops is not None and whole:
        say(f"measured as a whole, without crops of {WINDOW:g} µm: {counted(whole, 'scan')}")
    failed, samples = len(rows) - len(done), len({row["sample"] for row in rows})
    measured = counted(len(done), "scan")
    if args.crops is not None:
        measured = counted(len(done), "crop or whole scan", "crops and whole scans")
    seconds = elapsed(args)
    surface = f"{done[0]['surface']}, " if done else ""
    print(
        f"{args.output}: {measured} in survey.csv, {failed} failed, "
        f"{counted(samples, 'sample')} in samples.csv, {surface}{seconds:.1f} s"
    )
    args.code = 1 if failed else 0
    return {"rows": rows, "seconds": seconds}


def _read_by(scans: Sequence[Path]) -> Iterator[Path]:
    """Yield the scans with the files that their recipes name; survey.csv tells of wrong recipes."""
    for scan in scans:
        with contextlib.suppress(DiffractionError):
            yield from files_of(scan)


def _measured(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Measure new scans, here or on workers, and return the rows of all scans."""
    own_options, settings = options.load_options(args), options.table_options(args)

    from ..analysis.repeats import scan_files
    from ..analysis.survey import files_in

    args.files = scan_files(args.files)
    args.output = output_of(args, Path("survey"), files_in, make_folder=True)
    keep_in_mind(f"finished scans are in '{args.output}': run the command again to go on")

    from ..analysis.survey import run_survey

    treatment = load_treatments(args.treatments, Treatment(own_options, settings))
    variant = set_variant(args.mode or "llvm_ad_rgb")
    check_surface(surface_parameters(args))
    with client_of(args) as client, Bar(args, unit=" scans", delay=0) as bar:
        if client is not None:
            say_files(_read_by(args.files))
        return run_survey(
            args.files, args.output, treatment=treatment, variant=variant, theta=args.theta,
            resolution=args.resolution, threads=worker_threads(args), repeats=args.repeats,
            surface=surface_parameters(args), crops=args.crops,
            client=client, progress=bar,
        )  # fmt: skip
