"""`mitsuba-diffraction sweep`: BRDF maps over one parameter, on a contact sheet."""

from __future__ import annotations

import argparse
import csv
import math
import time
import warnings
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, DiffractionWarning
from ..thesis.methods import NAMES as METHODS
from .arguments import number_between, path_ending_in
from .heights_options import add_heights_options
from .light_options import add_direction, add_wavelengths
from .method_map import gain_of
from .output import check_outputs
from .patch import add_table_options, load_patch
from .progress import Bar

# Written out so that --help need not load what makes maps; a test holds them against the library.
KINDS = ("wavelength-step", "coherence-width", "terms", "light-angle", "method")

_COLUMNS = ("value", "seconds", "delta_e_mean", "delta_e_95", "delta_e_own_exposure", "blueness")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "sweep",
        help="BRDF maps over one parameter: wavelength step, coherence width, terms, light, method",
        description=(
            "Evaluate BRDF maps for several values of one parameter by the methods of the source "
            "documents, and put them on a contact sheet, with times and ΔE2000 from the best. A "
            "sweep over methods also times the package's own look-up against flss with both "
            "compiled. Writes a picture, and the numbers as CSV beside it."
        ),
    )
    parser.add_argument("kind", metavar="KIND", choices=KINDS, help=f"one of {', '.join(KINDS)}")
    parser.add_argument(
        "source", metavar="SOURCE", type=Path, help="heights of any format, or a recipe (.toml)"
    )
    parser.add_argument(
        "-o", "--output", metavar="OUT", type=path_ending_in(".png"),
        help="contact sheet; default: SOURCE's name with -KIND.png in the current folder",
    )  # fmt: skip
    parser.add_argument(
        "--values", metavar="V", nargs="+", help="of the parameter; default: the documents'"
    )
    _add_options(parser.add_argument_group("the maps"))
    add_heights_options(parser)
    parser.set_defaults(run=run, parser=parser)


def _add_options(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--method", choices=METHODS, default="flss",
        help="what evaluates, except in a sweep over methods; default: flss",
    )  # fmt: skip
    add_direction(group)
    add_wavelengths(group, 380.0, 780.0)
    group.add_argument(
        "--resolution", metavar="N", type=int, default=128, help="pixels a side; default: 128"
    )
    group.add_argument(
        "--samples", metavar="N", type=int, default=1, help="directions in a pixel; default: 1"
    )
    group.add_argument(
        "--exposure", metavar="EV", type=number_between(-100, 100),
        help="of all maps, in stops; default: the best map's own",
    )  # fmt: skip
    add_table_options(group, coherence="patch")
    group.add_argument("--period", metavar="D", type=float, help="µm; default: estimated")
    group.add_argument(
        "--relative",
        action="store_true",
        help="relative reflectance, as in the documents' pictures",
    )
    group.add_argument("--int-ior", metavar="N", help="of --relative; default: 1.5")
    group.add_argument(
        "--compiled", action=argparse.BooleanOptionalAction, default=True,
        help="time default and flss in compiled code, in a sweep over methods",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Evaluate all maps, compare, draw, and return the exit code."""
    from ..analysis.maps import Light
    from ..analysis.maps.sheet import contact_sheet
    from ..atomic import atomic_path
    from ..thesis.sweeps import sweep

    start = time.perf_counter()
    output = args.output or Path(f"{args.source.stem}-{args.kind}.png")
    numbers = output.with_suffix(".csv")
    check_outputs((output, numbers), [args.source], "sheet")
    light, values, gain = Light(args.theta, args.phi), _values(args), gain_of(args)
    if args.int_ior is not None and gain is None:
        args.parser.error("argument --int-ior: only with argument --relative")
    patch, settings = load_patch(args)
    settings |= {"wavelength_range": tuple(args.wavelength_range), "step": args.step}
    if args.period is not None:
        settings["period"] = args.period
    if values is None and args.kind == "method" and gain is not None:
        values = [name for name in METHODS if name != "rainbow"]
    with Bar(args) as bar, warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        result = sweep(
            args.kind, patch, light, values=values, method=args.method, gain=gain,
            resolution=args.resolution, samples=args.samples, progress=bar, **settings,
        )  # fmt: skip
        compiled = _compiled(args, patch, light, settings, bar)
    best = next((s for s in result.steps if s.label == result.reference), None)
    exposure = args.exposure if best is None or args.exposure is not None else best.map.exposure()
    where = "" if args.kind == "light-angle" else f", light at {light}"
    sheet = contact_sheet(
        [step.map for step in result.steps], [_title(step, result) for step in result.steps],
        title=f"{patch.name}: {args.kind}{where}", exposure=exposure,
    )  # fmt: skip
    with atomic_path(output) as path:
        sheet.savefig(path, format="png")
    _save(numbers, result)
    print(f"{output}, {numbers}: {time.perf_counter() - start:.1f} s")
    for line in [*_lines(result), *compiled]:
        print(f"  {line}")
    return 0


def _values(args: argparse.Namespace) -> list[Any] | None:
    """The values given, as the sweep takes them."""
    if args.values is None or args.kind == "method":
        return args.values
    try:
        return [int(v) if args.kind == "terms" else float(v) for v in args.values]
    except ValueError as error:
        given = " ".join(args.values)
        raise DiffractionError(f"--values: expected numbers, got '{given}'") from error


def _compiled(
    args: argparse.Namespace, patch: Any, light: Any, settings: dict[str, Any], bar: Bar
) -> list[str]:
    if args.kind != "method" or not args.compiled:
        return []
    from ..scene.load import set_variant
    from ..thesis.sweeps.compiled import time_compiled

    variant = set_variant(None)
    tables = {k: settings[k] for k in ("coherence_width", "tolerance") if k in settings}
    resolution = 2 * args.resolution  # below it Python's share shows
    found = time_compiled(
        patch, light, resolution=resolution, samples=args.samples, step=args.step,
        progress=bar, **tables,
    )  # fmt: skip
    return [
        f"compiled ({variant} and RGB), {resolution} x {resolution} pixels, 360–830 nm in steps of "
        f"{args.step:g} nm:",
        f"  flss {found.flss:.3g} s; default {found.spectral:.3g} s, {found.ratio:.3g}× as fast; "
        f"default, colours {found.colours:.3g} s, {found.colour_ratio:.3g}× as fast",
    ]


def _title(step: Any, result: Any) -> str:
    if result.reference is None:
        return str(step.label)
    if step.label == result.reference:
        return f"{step.label} (reference)"
    return f"{step.label}; ΔE {step.mean:.2g}"


def _lines(result: Any) -> list[str]:
    lines = []
    for step in result.steps:
        text = f"{step.label:<12} {step.seconds:7.2f} s"
        if step.label == result.reference:
            text += "  reference"
        elif math.isfinite(step.mean):
            text += (
                f"  ΔE {step.mean:.3g} mean, {step.high:.3g} at 95 %, {step.own_mean:.3g} with its "
                f"own exposure; Z/X × {step.blueness:.3g}"
            )
        lines.append(text)
    return lines


def _save(path: Path, result: Any) -> None:
    from ..atomic import atomic_path

    with (
        atomic_path(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        writer = csv.writer(stream)
        writer.writerow(_COLUMNS)
        for step in result.steps:
            numbers = (step.seconds, step.mean, step.high, step.own_mean, step.blueness)
            cells = [f"{n:.6g}" if math.isfinite(n) else "" for n in numbers]
            writer.writerow([step.value, *cells])
