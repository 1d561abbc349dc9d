"""Files of spectra: CSV as the R package pavo reads it, and a plot."""

from __future__ import annotations

import csv
import io
import os
from typing import TYPE_CHECKING

import numpy as np

from ..atomic import atomic_path
from ..optics.colour import encode_srgb, linear_srgb, response
from .spectra import Reals, Spectra

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Of a curve drawn: the brightest channel of its colour, so that white is grey on white paper.
_BRIGHTEST = 0.35
# Ratio of the highest to the lowest curve from which on the axis is logarithmic.
_APART = 20.0


def save_csv(spectra: Spectra, path: str | os.PathLike[str]) -> None:
    """Write spectra as the R package pavo reads them: `wl` in nm, then one column each, per cent.

    Without comments or units, which `read.csv` would take for data.
    """
    _write(path, spectra.wavelength, spectra.columns())


def save_errors(spectra: Spectra, path: str | os.PathLike[str]) -> None:
    """Write the standard errors of a mean, in the columns of `save_csv`, per cent."""
    assert spectra.error is not None
    columns = dict(zip(spectra.geometry.names, spectra.error.T, strict=True))
    _write(path, spectra.wavelength, columns)


def _write(path: str | os.PathLike[str], wavelength: Reals, columns: dict[str, Reals]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["wl", *columns])
    for n, lam in enumerate(wavelength):
        writer.writerow([f"{lam:g}", *(f"{100.0 * values[n]:.6g}" for values in columns.values())])
    with atomic_path(path) as temporary:
        temporary.write_text(text.getvalue(), "utf-8")


def colour_of(spectra: Spectra) -> Reals:
    """Return the colour of each spectrum in daylight, (detectors, 3) sRGB, as dark as ink."""
    step = np.gradient(spectra.wavelength) if spectra.wavelength.size > 1 else np.ones(1)
    weights = response(spectra.wavelength) * step[:, None]
    linear = np.maximum(linear_srgb(spectra.value.T @ weights), 0.0)
    brightest = linear.max(axis=1, keepdims=True)
    return encode_srgb(_BRIGHTEST * linear / np.where(brightest > 0.0, brightest, 1.0))


def spectra_figure(spectra: Spectra, title: str = "") -> Figure:
    """Draw spectra over wavelength, each in its own colour, with bands of one standard error."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 4.2), dpi=120, layout="constrained")
    axes = figure.subplots()
    geometry = spectra.geometry
    colours = colour_of(spectra)
    styles = ("-", "--", "-.", ":")
    for n, (angle, colour) in enumerate(zip(geometry.detectors, colours, strict=True)):
        values, style = 100.0 * spectra.value[:, n], styles[n % len(styles)]
        axes.plot(spectra.wavelength, values, style, color=colour, label=f"detector at {angle:g}°")
        if spectra.error is not None:
            error = 100.0 * spectra.error[:, n]
            axes.fill_between(
                spectra.wavelength, values - error, values + error, color=colour, alpha=0.2, lw=0
            )
    against = {
        "white": "reflectance (% of a white standard)",
        "mirror": "reflectance (% of a perfect mirror)",
        "none": "collected (% of the incident light)",
    }
    axes.set(xlabel="wavelength (nm)", ylabel=against[spectra.relative])
    highest = 100.0 * np.maximum(spectra.value.max(axis=0), 0.0)
    if 0.0 < _APART * highest.min() < highest.max():  # a mirror's reflection beside weak light
        axes.set_yscale("log")
        lowest = max(50.0 * float(spectra.value.min()), 1e-2 * highest.min())
        axes.set_ylim(lowest, 2.0 * highest.max())
    else:
        axes.set_ylim(0.0, None)
    axes.set_title(
        f"{title}\nlamp at {geometry.light:g}°, azimuth {geometry.azimuth:g}°; cone of "
        f"{geometry.acceptance:g}°".strip(),
        fontsize=9,
    )
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25)
    return figure
