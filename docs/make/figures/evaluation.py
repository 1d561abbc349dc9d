"""The grating equation: every method on every patch, in a picture and numbers of docs/thesis.md."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.gratings import blazed, elaphe_like, sinusoidal, xenopeltis_like
from mitsuba_diffraction.thesis.methods import FullSpectrum, make, make_all
from mitsuba_diffraction.thesis.period_fit import (
    Beam,
    Fit,
    Response,
    Ridge,
    draw,
    fit_period,
    measure,
    ridge_of,
    thesis_fit,
    window_fits,
)

from . import pages

METHODS = ("spectral", "flss", "nmm", "pq", "pq-sinc")

_DPI = 85
_STEP = 5.0  # nm


@dataclass(frozen=True)
class Evaluated:
    """Result of a method on a patch."""

    response: Response
    ridge: Ridge
    fit: Fit


@dataclass(frozen=True)
class Periods:
    """Periods of one patch, µm."""

    name: str  # of the patch
    by_method: dict[str, Evaluated]  # the methods' responses and fits
    nominal: float | None  # period that it is made with
    windows: tuple[float, float]  # mean and standard deviation of single windows
    count: int  # number of those windows
    thesis: float  # period that the procedure of the thesis finds; NaN if none


def evaluate_patch(
    patch: HeightField,
    nominal: float | None,
    *,
    wavelengths: Real,
    angles: Real,
    windows: int,
    methods: Sequence[str] = METHODS,
    coherence_width: float = 65.0,
) -> Periods:
    """Evaluate every method, and single windows, under a beam at 75°."""
    beam = Beam()
    by_name = make_all(methods, patch, coherence_width=coherence_width)
    results = {}
    for name, method in by_name.items():
        response = measure(method.brdf, beam, wavelengths, angles, sigma=method.sigma, label=name)
        ridge = ridge_of(response)
        results[name] = Evaluated(response, ridge, fit_period(ridge))
    single = make("spectral", patch, coherence="patch", coherence_width=coherence_width)
    assert isinstance(single, FullSpectrum)
    few = wavelengths[:: max(1, wavelengths.size // 20)]
    fits = window_fits(single.table, beam, few, angles, count=windows)
    try:
        thesis = thesis_fit(single.table, beam, wavelengths, angles).period
    except DiffractionError:
        thesis = float("nan")
    return Periods(
        patch.name, results, nominal, (fits.mean, fits.spread), windows, thesis
    )  # fmt: skip


def evaluation_figure(patches: Sequence[Periods]) -> Figure:
    """A row for each patch, a column for each method; one colour bar a row."""
    names = list(patches[0].by_method)
    figure = Figure(
        figsize=(3.0 * len(names) + 1.0, 2.7 * len(patches)), dpi=_DPI, layout="constrained"
    )
    FigureCanvasAgg(figure)
    grid = figure.subplots(len(patches), len(names), sharex=True, squeeze=False)
    for row, patch in enumerate(patches):
        largest = max(float(e.response.values.max()) for e in patch.by_method.values())
        for column, name in enumerate(names):
            axes, result = grid[row][column], patch.by_method[name]
            period = patch.nominal or result.fit.period
            shown = draw(axes, result.response, result.ridge, period, largest=largest)
            axes.set_title(f"{patch.name}, {name}", fontsize=9)
            axes.tick_params(labelsize=8)
            if row == len(patches) - 1:
                axes.set_xlabel("wavelength  [nm]", fontsize=8)
            if column == 0:
                axes.set_ylabel("viewing angle θₒ  [°]", fontsize=8)
            if column == len(names) - 1:
                bar = figure.colorbar(shown, ax=axes)
                bar.set_label("f·cos θₒ  [1/sr]", fontsize=8)
                bar.ax.tick_params(labelsize=7)
    return figure


def period_table(patches: Sequence[Periods]) -> str:
    """Fitted periods, in nm, as a Markdown table.

    The last columns are the mean and standard deviation of single windows, and the period found by
    the procedure of the thesis.
    """
    names = list(patches[0].by_method)
    header = ("patch", "nominal", *names, f"{patches[0].count} single windows", "thesis")
    rows = []
    for patch in patches:
        nominal = "" if patch.nominal is None else f"{1e3 * patch.nominal:.4g}"
        periods = [f"{1e3 * patch.by_method[name].fit.period:.5g}" for name in names]
        mean, spread = (1e3 * value for value in patch.windows)
        windows = f"{mean:.5g} ± {f'{spread:.2g}' if spread >= 0.01 else '0'}"
        thesis = "" if np.isnan(patch.thesis) else f"{1e3 * patch.thesis:.5g}"
        rows.append((patch.name, nominal, *periods, windows, thesis))
    return pages.table(header, rows)


def write_evaluation(args: argparse.Namespace, measured: HeightField | None) -> None:
    """Make the picture and the table of periods."""
    page = args.output or Path("docs/thesis.md")
    # with the periods that they are made with
    patches: list[tuple[HeightField, float | None]] = [
        (blazed(2.5, 0.25, pixels_per_period=60, rows=2), 2.5),
        (sinusoidal(1.6, 0.1, rows=2), 1.6),
    ]
    if measured is not None:
        patches.append((measured, None))
    if not args.small:
        patches += [(elaphe_like(), None), (xenopeltis_like(), None)]
    wavelengths = np.arange(380.0, 780.5, 40.0 if args.small else _STEP)
    angles = np.linspace(-30.0, 75.0, round(105.0 / args.angle_step) + 1)
    results = []
    for patch, nominal in patches:
        print(f"evaluating {patch.name}", flush=True)
        results.append(
            evaluate_patch(
                patch, nominal, wavelengths=wavelengths, angles=angles, windows=args.windows
            )
        )
    pages.update(page, {"periods": period_table(results)})
    picture = page.parent / "images" / "evaluation.png"
    pages.write_figure(picture, evaluation_figure(results))
