"""`mitsuba-diffraction sweep`: BRDF maps over one parameter, on a contact sheet."""

from __future__ import annotations

import argparse
import math
import warnings
from pathlib import Path
from typing import Any

from ..analysis.maps import LightDirection
from ..analysis.maps.picture import contact_sheet
from ..columns import save_rows
from ..errors import DiffractionError, DiffractionWarning
from ..images import save_figure
from ..scene.load import set_variant
from ..thesis.methods import NAMES
from ..thesis.sweeps import SWEEPS, sweep, time_compiled
from . import options
from .brdf_map import RELATIVE, gain_of
from .console import Bar
from .report import Figures, beside, elapsed, output_of
from .values import STOPS, path_ending_in

# Option of each sweep's own quantity.
_SWEPT = {
    "wavelength-step": "step", "coherence-width": "coherence_width", "terms": "terms",
    "light-angle": "theta", "method": "method",
}  # fmt: skip
_COLUMNS = ("value", "seconds", "delta_e_mean", "delta_e_95", "delta_e_own_exposure", "blueness")


@options.command(
    "sweep", "BRDF maps over one parameter: wavelength step, coherence width, terms, light, method",
    "Evaluate BRDF maps for several values of one parameter by the methods of the 2014 "
    "thesis, and put them on a contact sheet, with times and ΔE2000 from the best. A "
    "sweep over methods also times the package's own look-up against flss with both "
    "compiled. Writes a picture, and the numbers as CSV beside it.",
    ("KIND", f"one of {', '.join(SWEEPS)}", tuple(SWEEPS)),
    options.SOURCE,
    ("-o --output OUT", "contact sheet; default: SOURCE's name with -KIND.png in the current "
     "folder", path_ending_in(".png")),
    ("--values V ...", "values to compare; default: those of the thesis"),
    options.Group("the maps", (
        *options.method("flss", "what evaluates, except in a sweep over methods"),
        *options.direction(),
        *options.SPECTRUM,
        ("--resolution N", "pixels a side", int, 128),
        ("--samples N", "directions in a pixel", int, 1),
        ("--exposure EV", "of all maps, in stops; default: the best map's own", STOPS),
        *options.table(options.TABLE_NAMES, coherence="patch"),
        RELATIVE,
        ("--int-ior N", "index for --relative; default: 1.5"),
        ("--compiled", "time spectral and flss in compiled code, in a sweep over methods", None,
         None, {"action": argparse.BooleanOptionalAction, "default": True}),
    )),
    options.json(),
    options.heights(),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Evaluate all maps, compare, draw, and return the figures."""
    swept = f": has no effect on a sweep over {args.kind}; give its values by --values"
    options.refuse(args, [_SWEPT[args.kind]], swept)
    if args.kind != "method":
        options.refuse(args, ["compiled"], ": is for a sweep over methods; leave it out")
        options.refuse_unused(args)
    files = beside(".csv")
    output, numbers = files(output_of(args, Path(f"{args.source.stem}-{args.kind}.png"), files))
    light, values, gain = LightDirection(args.theta, args.phi), _values(args), gain_of(args)
    patch, settings = options.load_patch(args)
    settings |= {"wavelength_range": args.wavelength_range, "step": args.step}
    if args.period is not None:
        settings["period"] = args.period
    if values is None and args.kind == "method" and gain is not None:
        values = [name for name in NAMES if name != "rainbow"]
    with Bar(args) as bar, warnings.catch_warnings(action="ignore", category=DiffractionWarning):
        result = sweep(
            args.kind, patch, light, values=values, method=args.method,
            gain=gain, resolution=args.resolution, samples=args.samples, progress=bar, **settings,
        )  # fmt: skip
        compiled = _compiled(args, patch, light, settings, bar)
    best = next((s for s in result.steps if s.label == result.reference), None)
    exposure = args.exposure if best is None or args.exposure is not None else best.map.exposure()
    where = "" if args.kind == "light-angle" else f", light at {light}"
    sheet = contact_sheet(
        [step.map for step in result.steps], [_title(step, result) for step in result.steps],
        title=f"{patch.name}: {args.kind}{where}", exposure=exposure,
    )  # fmt: skip
    save_figure(output, sheet)
    save_rows(numbers, _COLUMNS, map(_row, result.steps), digits=6)
    print(f"{output}, {numbers}: {elapsed(args):.1f} s")
    for line in [*_lines(result), *compiled]:
        print(f"  {line}")
    return {"patch": patch.name, "sweep": args.kind, "steps": [*map(_row, result.steps)]}


def _values(args: argparse.Namespace) -> list[Any] | None:
    """Return the values on the command line in the form that the sweep takes."""
    if args.values is None:
        return None
    if args.kind == "method":
        return list(args.values)
    try:
        return [int(v) if args.kind == "terms" else float(v) for v in args.values]
    except ValueError as error:
        text = " ".join(args.values)
        line = f"--values: expected numbers, blanks between, got '{text}'"
        raise DiffractionError(line) from error


def _compiled(
    args: argparse.Namespace, patch: Any, light: Any, settings: dict[str, Any], bar: Bar
) -> list[str]:
    if args.kind != "method" or not args.compiled:
        return []
    variant = set_variant(None)
    tables = {k: settings[k] for k in ("coherence_width", "tolerance") if k in settings}
    resolution = 2 * args.resolution  # below it Python's share shows
    times = time_compiled(
        patch, light, resolution=resolution, samples=args.samples, step=settings["step"],
        progress=bar, **tables,
    )  # fmt: skip
    return [
        f"compiled ({variant} and RGB), {resolution} x {resolution} pixels, 360–830 nm in steps of "
        f"{settings['step']:g} nm:",
        f"  flss {times.flss:.3g} s; spectral {times.spectral:.3g} s, {times.ratio:.3g}× as fast; "
        f"RGB {times.colours:.3g} s, {times.colour_ratio:.3g}× as fast",
    ]


def _title(step: Any, result: Any) -> str:
    if result.reference is None:
        return step.label
    if step.label == result.reference:
        return f"{step.label} (reference)"
    return f"{step.label}; ΔE {step.difference.delta_e:.2g}"


def _lines(result: Any) -> list[str]:
    lines = []
    for step in result.steps:
        text = f"{step.label:<12} {step.seconds:7.2f} s"
        if step.label == result.reference:
            text += "  reference"
        elif math.isfinite(step.difference.delta_e):
            d = step.difference
            text += (
                f"  ΔE {d.delta_e:.3g} mean, {d.delta_e_95:.3g} at 95 %, "
                f"{d.delta_e_own_exposure:.3g} with its own exposure; Z/X × {d.blueness:.3g}"
            )
        lines.append(text)
    return lines


def _row(step: Any) -> dict[str, Any]:
    value = step.value
    return dict(zip(_COLUMNS, (value, step.seconds, *step.difference), strict=True))
