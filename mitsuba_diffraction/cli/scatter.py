"""`mitsuba-diffraction scatter`: power spectrum and scatter of a rough mirror."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ..columns import save_numbers
from ..images import save_figure
from ..settings import TableSettings
from ..tables.build.build import build_with
from ..tables.powers import scattered_share
from . import options
from .console import Bar, say_warning
from .report import Figures, beside, output_of

#: He-Ne laser, nm.
_WAVELENGTH = 632.8


@options.command(
    "scatter", "power spectrum and scatter of a rough mirror",
    "Write the power spectral density of the heights as CSV and a picture, and print RMS, "
    "slope, band, the total integrated scatter by Rayleigh-Rice (Q = R) beside that of the "
    "table's orders, and an ABg model, at normal incidence and over the reflectance.",
    options.SOURCE,
    ("-o --output OUT", "the CSV; the picture (.png) lies beside it; default: SOURCE's name "
     "with -scatter.csv in the current folder", options.path_ending_in(".csv")),
    ("--wavelength NM", "wavelengths in vacuum", options.numbers, f"{_WAVELENGTH:g}",
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
        WORST_FIT,
        ABg,
        abg_model,
        power_spectrum,
        rayleigh_rice_scatter,
    )

    field, settings = options.load_patch(args)
    spectrum = power_spectrum(field)
    asked = TableSettings(**settings | {"wavelength_range": ends})
    with Bar(args) as bar:
        table = build_with(field, asked, bar)
    if notes := options.notes(args, field, asked):
        say_warning(notes)
    rows: list[dict[str, Any]] = []
    for wavelength in args.wavelengths:
        model = abg_model(spectrum, wavelength)
        rows.append({
            "wavelength": wavelength,
            "tis_rayleigh_rice": rayleigh_rice_scatter(field, wavelength),
            "tis_table": scattered_share(table, wavelength),
            **(dict.fromkeys(ABg._fields) if model is None else model._asdict()),
        })  # fmt: skip
    numbers = np.column_stack([spectrum.frequency, spectrum.density])
    save_numbers(output, ("frequency_per_um", "psd_um4"), numbers)
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.loglog(spectrum.frequency, spectrum.density, label="heights")
    if rows[0]["range"] is not None:
        lam = 1e-3 * rows[0]["wavelength"]
        beta = np.geomspace(rows[0]["range"][0], rows[0]["range"][1], 64)
        fitted = rows[0]["a"] / (rows[0]["b"] + beta ** rows[0]["g"])
        axes.loglog(beta / lam, fitted * lam**4 / (16.0 * np.pi**2), "--", label="ABg model")
    axes.set(xlabel="spatial frequency, 1/µm", ylabel="power spectral density, µm⁴")
    axes.legend()
    save_figure(output.with_suffix(".png"), figure)
    short, long = spectrum.band
    print(f"{args.source} -> {output}, {output.with_suffix('.png')}")
    print(
        f"  heights   {1e3 * spectrum.rms:.3g} nm RMS, slope {spectrum.slope:.3g}, spatial "
        f"wavelengths {short:.3g} to {long:.3g} µm"
    )
    for row in rows:
        fit = f"no ABg model fits within {WORST_FIT:.0%}"
        if row["range"] is not None:
            fit = (
                f"A {row['a']:.3g} 1/sr, B {row['b']:.3g}, g {row['g']:.3g} for |β − β₀| "
                f"{row['range'][0]:.2g} to {row['range'][1]:.2g}, within {row['error']:.0%}"
            )
        print(
            f"  {row['wavelength']:g} nm  TIS {row['tis_rayleigh_rice']:.3g} by Rayleigh-Rice, "
            f"{row['tis_table']:.3g} of the table; {fit}"
        )
    return {"rms_um": spectrum.rms, "slope": spectrum.slope, "band_um": list(spectrum.band),
            "wavelengths": rows}  # fmt: skip
