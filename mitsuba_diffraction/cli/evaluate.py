"""`mitsuba-diffraction evaluate`: a monochromatic beam against the grating equation."""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..analysis.known_wavelengths import check_material
from ..analysis.media import in_medium, medium_index, optical_scale
from ..analysis.scans import bsdf_of, check_surface, table_of
from ..analysis.spectra import brdf_values, table_range
from ..errors import DiffractionError, DiffractionWarning, counted
from ..heights import HeightField, dominant_periods
from ..heights.coherence import resolved_width
from ..heights.spectra import Periodicity
from ..images import save_figure
from ..plugin.dictionary import bsdf_dict
from ..scene import set_variant
from ..settings import TableSettings
from ..tables import TableSource
from ..thesis.methods import make
from ..thesis.methods.method import trapezoid_rule
from ..thesis.methods.periods import check_period
from . import options
from .brdf_map import MATERIAL, surface_parameters
from .console import Bar, say_warning
from .report import Figures, beside, elapsed, output_of
from .values import limits, path_ending_in, whole_number

if TYPE_CHECKING:
    from ..thesis.period_fit import Beam, Fit, Response, Ridge

# Single windows are fitted at about so many wavelengths: the period needs no more.
_FEW = 20
# A plane of incidence closer to the grooves than 78° from across them meets none of their orders.
_LEAST_COSINE = 0.2
# Viewing angles span this many degrees at least.
_NARROWEST = 20.0


class _Experiment(NamedTuple):
    """Patch under a beam: gratings, periods in the plane of incidence (µm), and the axes."""

    patch: HeightField
    within: TableSource  # the patch, lengths times the medium's index
    settings: dict[str, Any]  # of the method
    gratings: Sequence[Periodicity]
    held: list[float]
    beam: Beam
    steps: Any  # (W,) nm
    angles: Any  # (A,) degrees


@options.command(
    "evaluate", "compare the angles of maxima with the grating equation",
    "Put a patch under a monochromatic beam, follow the brightest viewing angle through "
    "the spectrum, and fit the period of the grating equation to it. Writes a picture, and "
    "the numbers as CSV (the ridge) and NPZ (everything) beside it.",
    options.SOURCE,
    ("-o --output OUT", "picture; default: SOURCE's name with -evaluation.png in the current "
     "folder", path_ending_in(".png")),
    options.Group("the beam", (
        *options.direction(theta=75.0, phi=None),
        *options.SPECTRUM,
        ("--angles FIRST:LAST", "viewing angles, degrees, positive away from the light; default: "
         "the order of the patch's own period, to the mirror direction",
         limits),
        ("--angle-step DEG", "", float, 0.1),
        ("--order M", "order that is followed", int, 1),
    )),
    options.Group("the model", (
        *options.method("spectral", "what evaluates"),
        *options.table(
            options.TABLE_NAMES,
            coherence="ensemble for spectral, patch for the thesis' own methods",
        ),
        ("--positions N", "window positions whose own periods are fitted, for the spread; 0 "
         "leaves them out", whole_number(0), 32, {"dest": "positions"}),
    )),
    options.Group("the surface; methods other than spectral have R = 1", MATERIAL),
    options.json(),
    options.heights(),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Measure, fit, draw, and return the figures."""
    files = beside(".csv", ".npz")
    written = files(output_of(args, Path(f"{args.source.stem}-evaluation.png"), files))
    experiment = _prepared(args)
    patch, _, settings, gratings, held, beam, steps, angles = experiment
    from ..thesis.period_fit import measure
    from ..thesis.period_fit.plot import figure, save_csv, save_npz

    # `options.notes` has them
    quiet = warnings.catch_warnings(action="ignore", category=DiffractionWarning)
    with Bar(args) as bar, quiet:
        brdf, sigma = _brdf(args, experiment, bar)
        response = measure(
            brdf, beam, steps, angles, sigma=sigma, label=args.method, progress=bar,
        )  # fmt: skip
        ridge, fit, line = _followed(response, args.order, held)
        lines, more = _windows(args, experiment, fit, bar)
    width = settings.get("coherence_width", "auto")
    found = (math.nan, math.nan, math.nan) if fit is None else (fit.period, fit.error, fit.residual)
    figures = {
        **more, **dict(zip(("fitted_period", "fit_error", "residual"), found, strict=True)),
        "coherence_width": resolved_width(width, [patch]), "source": str(args.source),
    }  # fmt: skip
    report = [*(("spectrum", str(grating)) for grating in gratings), ("fitted", line), *lines]
    period = found[0] if args.period is None else args.period
    picture = figure(
        response, ridge if fit else None, None if math.isnan(period) else period,
        order=args.order, title=patch.name,
        notes="\n".join(f"{name}: {text}" for name, text in report),
    )  # fmt: skip
    save_figure(written[0], picture)
    save_csv(written[1], ridge, period)
    save_npz(written[2], ridge, period, figures)
    print(
        f"{', '.join(map(str, written))}: {patch.name}, method {args.method}, light at {beam}, "
        f"{counted(steps.size, 'wavelength')}, {counted(angles.size, 'angle')}, "
        f"{elapsed(args):.1f} s"
    )
    if distance := _distance(args, ridge):
        report.insert(len(gratings) + 1, ("given", distance))
    for name, text in report:
        print(f"  {name:<9} {text}")
    asked = TableSettings(coherence_width=width, wavelength_range=settings["wavelength_range"])
    if notes := options.notes(args, patch, asked):
        say_warning(notes)
    print(f"  {'period':<9} {_published(fit, more.get('window_error'))}")
    return {"patch": patch.name, "method": args.method, "theta": beam.theta, "phi": beam.phi,
            **figures}  # fmt: skip


def _prepared(args: argparse.Namespace) -> _Experiment:
    """Check the options, read the patch, and choose the beam and the viewing angles."""
    from ..thesis.period_fit import Beam
    from ..thesis.period_fit.ridge import check_axes, check_order
    from ..thesis.period_fit.windows import MOST_WINDOWS

    check_order(args.order)
    beam = Beam(args.theta, args.phi or 0.0, medium_index(args.ext_ior))
    if args.period is not None:
        check_period(args.period)
    if args.positions > MOST_WINDOWS:
        raise DiffractionError(f"positions={args.positions} must be from 0 to {MOST_WINDOWS}")
    spectrum = {"wavelength_range": args.wavelength_range, "step": args.step}
    steps = trapezoid_rule(args.wavelength_range, args.step)[0]
    viewing_angles(args.angles, args.angle_step, args.theta, args.order)
    patch, settings = options.load_patch(args)
    ours = _by_table(args, settings)
    options.refuse_unused(args, ("period", "step", *(["terms"] if ours else [])))
    if surface_parameters(args) and not ours:
        choice = f"--method {args.method}" if args.method != "spectral" else "--coherence patch"
        raise DiffractionError(
            f"{choice} reflects all light; leave the material out, or {choice.split()[0]}"
        )
    gratings = dominant_periods(patch)
    if args.phi is None and gratings:
        beam = replace(beam, phi=float(round(gratings[0].direction)))  # known to a degree
    held = periods_along(gratings, beam.phi)
    # mλ/(n d) of its last colour
    reach = args.order * float(beam.waves(steps[-1])) / max(held) if held else None
    angles = viewing_angles(args.angles, args.angle_step, args.theta, args.order, reach)
    check_axes(steps, angles)
    within = in_medium(TableSource.of(patch), args.ext_ior)
    return _Experiment(patch, within, {**settings, **spectrum}, gratings, held, beam, steps, angles)


def _by_table(args: argparse.Namespace, settings: dict[str, Any]) -> bool:
    """Whether a table's BSDF is measured, not a method of the thesis, which has R = 1."""
    return args.method == "spectral" and settings.get("coherence") != "patch"


def _brdf(args: argparse.Namespace, experiment: _Experiment, bar: Bar) -> tuple[Any, float]:
    """Return the BRDF to measure and σ of its window: a method's, or of a surface of a material."""
    within, settings = experiment.within, experiment.settings
    if not _by_table(args, settings):
        method = make(args.method, within.field(), period=args.period, progress=bar, **settings)
        return method.brdf, method.sigma
    steps = experiment.steps
    check_material(args.material, steps, args.pigment)
    set_variant("llvm_ad_spectral")
    asked = {name: value for name, value in settings.items() if name != "step"}
    asked["wavelength_range"] = table_range(steps)
    parameters = surface_parameters(args)
    check_surface(parameters)
    table = table_of(within, within.settings_for(asked, optical_scale(parameters)), bar)
    return partial(brdf_values, bsdf_of(bsdf_dict(table, **parameters))), table.sigma


def _distance(args: argparse.Namespace, ridge: Ridge) -> str:
    """Describe how far the ridge is from the period that is given; "" without either."""
    if args.period is None:
        return ""
    apart = np.abs(ridge.angles - ridge.grating_angles(args.period))
    if not np.isfinite(apart).any():
        return ""
    return f"{1e3 * args.period:.6g} nm, the ridge is within {np.nanmax(apart):.2g}° of it"


def periods_along(gratings: Sequence[Periodicity], phi: float) -> list[float]:
    """Return the periods in µm of gratings in a plane of incidence, by its azimuth in degrees."""
    cosines = [abs(math.cos(math.radians(g.direction - phi))) for g in gratings]
    # a plane along the grooves meets none of their orders
    return [g.period / c for g, c in zip(gratings, cosines, strict=True) if c > _LEAST_COSINE]


def _followed(
    response: Response, order: int, held: Sequence[float]
) -> tuple[Ridge, Fit | None, str]:
    """Find the ridge that obeys the grating equation, fit its period, and describe the fit.

    Raises a DiffractionError if there are too few maxima to look for one.
    """
    from ..thesis.period_fit import FEWEST, Ridge, find_period, fit_period, ridge_of

    period = find_period(response, held, order)
    near = max(held, default=None) if abs(order) > 1 else None  # the first order is brighter
    ridge = ridge_of(response, order, period=period or near)
    if period is not None:
        fit = fit_period(ridge)
        return ridge, fit, (
            f"{1e3 * fit.period:.6g} nm, residual {fit.residual:.2g}° RMS, {fit.largest:.2g}° at "
            f"most, {fit.points} of {fit.wavelengths} wavelengths"
        )  # fmt: skip
    nothing = np.full(response.wavelengths.size, np.nan)
    none = "none: the light on this side follows no grating equation"
    if ridge.has_maximum.sum() >= FEWEST or order != 1:  # an order that was chosen is named
        brightest = fit_period(ridge).period
        none += f" (the brightest angles alone would give {1e3 * brightest:.4g} nm)"
    return Ridge(response, order, nothing, nothing), None, none


def viewing_angles(
    limits: Any, step: float, theta: float, order: int, reach: float | None = None
) -> Any:
    """Viewing angles in degrees, (A,); by default from the mirror direction to the horizon's side.

    reach : mλ/(n d) of the order's last colour, signed; the range ends a quarter beyond it.

    Raises a DiffractionError if the range is empty or the step does not fit it.
    """
    sign = 1 if order > 0 else -1
    end = 80.0
    if reach is not None:
        # mirrored for negative orders: the sine on the order's own side
        sine = 1.25 * abs(reach) - sign * math.sin(math.radians(theta))
        end = min(end, max(math.degrees(math.asin(min(sine, 1.0))), _NARROWEST - sign * theta))
    low, high = limits or sorted((theta, -sign * end))
    if not -90.0 < low < high < 90.0:
        raise DiffractionError(
            f"angles={low:g}:{high:g} degrees are none; give the lower first, both within -90 "
            "and 90, e.g. -60:75"
        )
    if not 1e-3 <= step <= high - low:
        raise DiffractionError(
            f"angle-step={step:g} does not fit {low:g} to {high:g} degrees; it must be from 0.001 "
            f"to {high - low:g}"
        )
    return np.linspace(low, high, round((high - low) / step) + 1)


def _windows(
    args: argparse.Namespace, experiment: _Experiment, fit: Fit | None, bar: Bar
) -> tuple[list[tuple[str, str]], dict[str, Any]]:
    """Measure single windows by the thesis' procedure: lines to print, and entries of the NPZ."""
    if args.positions == 0 or fit is None:
        return [], {}
    from ..thesis.period_fit import thesis_fit, window_fits

    _, within, settings, _, _, beam, steps, angles = experiment
    few = steps[:: max(1, steps.size // _FEW)]
    # the look-up in the package's own series: a single window's amplitudes
    single = {**settings, "coherence": "patch"}
    try:
        table = make("spectral", within.field(), progress=bar, **single).table  # type: ignore[attr-defined]
    except DiffractionError as error:  # a strip has too many orders under a window of its width
        return [("windows", str(error))], {}
    lines: list[tuple[str, str]] = []
    more: dict[str, Any] = {}
    try:
        fits = window_fits(
            table, beam, few, angles, count=args.positions, order=args.order,
            period=fit.period, progress=bar,
        )  # fmt: skip
    except DiffractionError as error:
        lines.append(("windows", str(error)))
    else:
        periods = 1e3 * fits.periods
        more |= {"window_periods": fits.periods, "window_places": fits.centres,
                 "window_error": fits.error}  # fmt: skip
        lines.append(
            ("windows", f"{periods.size} of {args.positions} window positions: "
             f"{1e3 * fits.mean:.5g} ± {1e3 * fits.total:.2g} nm each, {periods.min():.5g} to "
             f"{periods.max():.5g} nm")
        )  # fmt: skip
    try:
        as_in_thesis = thesis_fit(table, beam, steps, angles, args.order, fit.period)
    except DiffractionError as error:
        lines.append(("thesis", f"its procedure finds no period ({error})"))
    else:
        more["thesis_period"] = as_in_thesis.period
        lines.append(
            ("thesis", f"{1e3 * as_in_thesis.period:.5g} nm by its procedure (phase without w, one "
             "window, on the corner)")
        )  # fmt: skip
    return lines, more


def _published(fit: Fit | None, window_error: float | None) -> str:
    """Describe the period to publish: the fit's, with all errors that are known.

    window_error : µm, of the window's position; None if it was not examined.
    """
    if fit is None:
        return "none to publish: no ridge follows the grating equation"
    parts = [f"fit {1e3 * fit.error:.2g} nm"]
    if window_error is None:
        parts.append("window's position not examined")
    else:
        parts.append(f"window's position {1e3 * window_error:.2g} nm")
    error = 1e3 * math.hypot(fit.error, window_error or 0.0)
    digits = max(0, 1 - math.floor(math.log10(error))) if error > 0.0 else 2
    return (
        f"{1e3 * fit.period:.{digits}f} ± {error:.{digits}f} nm to publish ({', '.join(parts)}; "
        "the pixel size's relative error, unknown here, adds to it)"
    )
