"""`mitsuba-diffraction scatter`: power spectrum and scatter of a rough mirror."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..columns import save_rows
from ..errors import DiffractionError
from ..heights.coherence import resolved
from ..images import save_figure
from ..settings import TableSettings
from ..tables.build.build import build_with
from ..tables.powers import scattered_share
from . import options
from .console import Bar, say_warning
from .report import Figures, beside, output_of
from .values import numbers, path_ending_in

#: He-Ne laser, nm.
_WAVELENGTH = 632.8


@options.command(
    "scatter", "power spectrum and scatter of a rough mirror",
    "Write the power spectral density of the heights as CSV and a picture, and print RMS, slope, "
    "the total integrated scatter by Rayleigh-Rice (Q = R) beside that of the table's orders, all "
    "of one printed band, and an ABg model, at normal incidence and over the reflectance. Of a "
    "scan, the best surface of second degree is form and subtracted, unless --level names another.",
    options.SOURCE,
    ("-o --output OUT", "the CSV; the picture (.png) lies beside it; default: SOURCE's name "
     "with -scatter.csv in the current folder", path_ending_in(".csv")),
    ("--wavelength NM", "wavelengths in vacuum", numbers, f"{_WAVELENGTH:g}",
     {"dest": "wavelengths"}),
    *options.table(("coherence_width", "tolerance")),
    options.json(),
    options.heights(),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Write the spectrum, and return the figures."""
    ends = min(args.wavelengths) - 1.0, max(args.wavelengths) + 1.0
    if not 10.0 <= ends[0] < ends[1] <= 1e5:
        args.parser.error("argument --wavelength: expected wavelengths from 11 to 99999 nm")
    output = output_of(args, Path(f"{args.source.stem}-scatter.csv"), beside(".png"))
    from matplotlib.figure import Figure

    from ..heights.scatter import (
        ABg,
        abg_model,
        longest_of,
        power_spectrum,
        rayleigh_rice_scatter,
    )

    field, settings = options.load_patch(args)
    if field.cut_out and options.level_of(args) is None:
        field = field.treated(level="quadratic")  # a mirror's form scatters no light
    asked = TableSettings(**settings | {"wavelength_range": ends})
    longest = longest_of(resolved(asked, [field]))
    spectrum = power_spectrum(field, longest)
    with Bar(args) as bar:
        table = build_with(field, asked, bar)
    if notes := options.notes(args, field, asked):
        say_warning(notes)
    rows: list[dict[str, Any]] = []
    models: list[str] = []
    for wavelength in args.wavelengths:
        scatter = rayleigh_rice_scatter(field, wavelength, longest)
        row = {
            "wavelength": wavelength, "rms_um": scatter.rms, "band_um": list(scatter.band),
            "tis_rayleigh_rice": scatter.share,
            "tis_table": scattered_share(table, wavelength, scatter.band),
        }  # fmt: skip
        try:
            model = abg_model(spectrum, wavelength)
        except DiffractionError as error:
            rows.append(row | dict.fromkeys(ABg._fields))
            models.append(f"no ABg model: {error}")
        else:
            rows.append(row | model._asdict())
            low, high = model.range
            models.append(
                f"A {model.a:.3g} 1/sr, B {model.b:.3g}, g {model.g:.3g} for |β − β₀| "
                f"{low:.2g} to {high:.2g}, within {model.error:.0%}"
            )
    numbers = np.column_stack([spectrum.frequency, spectrum.density])
    save_rows(output, ("frequency_per_um", "psd_um4"), numbers, digits=7)
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(spectrum.frequency, spectrum.density, label="heights")
    if spectrum.rms > 0.0:  # no logarithm shows a flat patch
        axes.set(xscale="log", yscale="log")
    if rows[0]["range"] is not None:
        lam = 1e-3 * rows[0]["wavelength"]
        beta = np.geomspace(rows[0]["range"][0], rows[0]["range"][1], 64)
        fitted = rows[0]["a"] / (rows[0]["b"] + beta ** rows[0]["g"])
        axes.plot(beta / lam, fitted * lam**4 / (16.0 * np.pi**2), "--", label="ABg model")
    axes.set(xlabel="spatial frequency, 1/µm", ylabel="power spectral density, µm⁴")
    axes.legend()
    save_figure(output.with_suffix(".png"), figure)
    print(f"{args.source} -> {output}, {output.with_suffix('.png')}")
    print(f"  heights   {_of_band(spectrum.rms, spectrum.band)}, slope {spectrum.slope:.3g}")
    for line in field.history:
        print(f"            {line}")
    for row, model_text in zip(rows, models, strict=True):
        print(
            f"  {row['wavelength']:g} nm  {_of_band(row['rms_um'], row['band_um'])}, TIS "
            f"{row['tis_rayleigh_rice']:.3g} by Rayleigh-Rice, {row['tis_table']:.3g} of the "
            f"table\n            {model_text}"
        )
    return {"rms_um": spectrum.rms, "slope": spectrum.slope, "band_um": list(spectrum.band),
            "wavelengths": rows}  # fmt: skip


def _of_band(rms: float, band: Sequence[float]) -> str:
    """Describe the RMS height of a band of spatial wavelengths, all in µm."""
    return f"{1e3 * rms:.3g} nm RMS of spatial wavelengths {band[0]:.3g} to {band[1]:.3g} µm"
