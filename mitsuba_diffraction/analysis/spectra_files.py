"""Files of spectra: CSV as the R package pavo reads it, colours, and a plot."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..arrays import Real
from ..columns import save_rows
from ..errors import DiffractionError
from ..optics.colour import encode_srgb
from .angular_variables import VARIABLES
from .observers import Eye, contrasts, luminance_contrasts, noises, quantum_catches
from .spectra import Spectra, mean_spectra
from .spectral_variables import colours_of, daylit

#: Fewest detectors from which on a map of angle and wavelength is drawn beside curves.
MAPPED = 8

#: Azimuth of a lamp that is turned for each scan.
EACH = "of each scan"

# Of a curve drawn: the brightest channel of its colour, so that white is grey on white paper.
_BRIGHTEST = 0.35
# Ratio of the highest to the lowest curve from which on the axis is logarithmic.
_APART = 20.0
# Curves whose legend fits into the plot.
_FEW = 4
_STYLES = ("-", "--", "-.", ":")

#: Spectra by the name of their group; "" without groups.
Groups = Mapping[str, Spectra]


def means_of(groups: Mapping[str, Sequence[Spectra]]) -> dict[str, Spectra]:
    """Return the mean of the spectra of each group, at the wavelengths that all have."""
    every = [each for members in groups.values() for each in members]
    common = functools.reduce(np.intersect1d, [each.wavelength for each in every])
    if not common.size:
        raise DiffractionError("the tables share no wavelength; build them for one range")

    def cut(each: Spectra) -> Spectra:
        kept = np.isin(each.wavelength, common)
        s, p = (None if x is None else x[kept] for x in (each.s, each.p))
        return replace(each, wavelength=common, value=each.value[kept], s=s, p=p)

    return {name: mean_spectra([*map(cut, members)]) for name, members in groups.items()}


def columns_of(groups: Groups) -> dict[str, Real]:
    """Return the spectra of all groups by name."""
    return {k: v for name, each in groups.items() for k, v in each.columns(name).items()}


def errors_of(groups: Groups) -> dict[str, Real]:
    """Return the standard errors of means by the names of `columns_of`."""
    return {
        name: values
        for group, each in groups.items() if each.error is not None
        for name, values in zip(each.names(group), each.error.T, strict=True)
    }  # fmt: skip


def save_csv(path: Path, wavelength: Real, columns: Mapping[str, Real]) -> None:
    """Write spectra as the R package pavo reads them: `wl` in nm, then one column each, per cent.

    Without comments or units, which `read.csv` would take for data.
    """
    rows = np.column_stack([wavelength, *(100.0 * each for each in columns.values())])
    save_rows(path, ["wl", *columns], rows, digits=6)


def save_colours(groups: Groups, path: Any) -> None:
    """Write `spectral_variables.colours_of` of each spectrum, a row each."""
    rows = [
        row | {"spectrum": name}
        for group, each in groups.items()
        for name, row in zip(each.names(group), colours_of(each), strict=True)
    ]
    columns = ("spectrum", "srgb", "hue", "chroma", "B1", "B2", "B3", "S8", "H1", "FWHM")
    save_rows(path, columns, rows)


def save_angular(groups: Groups, path: Any) -> None:
    """Write `angular_variables` of each surface, a row each, with its group and number."""
    rows = [
        {"group": group, "scan": number, **row}
        for group, each in groups.items()
        for number, row in enumerate(each.angular, 1)
    ]
    save_rows(path, ("group", "scan", *VARIABLES), rows)


def save_catches(
    groups: Groups, eye: Eye, illuminant: Real, catches_path: Any, contrasts_path: Any
) -> None:
    """Write quantum catches of each spectrum, and contrasts of colour and luminance in JND.

    illuminant : quanta of the light, of `observers.illuminant_of`.
    """
    names = [name for group, each in groups.items() for name in each.names(group)]
    catches = np.concatenate(
        [quantum_catches(eye, each.wavelength, each.value, illuminant) for each in groups.values()]
    )
    rows = [
        {"spectrum": name, **dict(zip(eye.names, row, strict=True))}
        for name, row in zip(names, catches.tolist(), strict=True)
    ]
    save_rows(catches_path, ("spectrum", *eye.names), rows, digits=6)
    distances, steps = contrasts(catches, noises(eye)), luminance_contrasts(eye, catches)
    columns = ("patch1", "patch2", "dS", "dL")
    pairs = [
        dict(zip(columns, (names[i], names[j], distances[i, j], steps[i, j]), strict=True))
        for i, j in itertools.combinations(range(len(names)), 2)
    ]
    save_rows(contrasts_path, columns, pairs, digits=6)


def colour_of(spectra: Spectra) -> Real:
    """Return the colour of each spectrum in daylight, (detectors, 3) sRGB, as dark as ink."""
    linear = daylit(spectra)
    brightest = linear.max(axis=1, keepdims=True)
    return encode_srgb(_BRIGHTEST * linear / np.where(brightest > 0.0, brightest, 1.0))


def spectra_figure(
    groups: Groups, title: str = "", azimuth: str = "",
    measured: tuple[Real, Real] | None = None,
) -> Figure:  # fmt: skip
    """Draw spectra over wavelength, with bands of one standard error.

    Each curve has its own colour; of several groups, each group one. From `MAPPED` detectors on a
    map of angle and wavelength stands beside.

    azimuth : of the lamp in words, where the scans of a mean have several.
    measured : wavelengths, nm, and values (n,) of a curve to draw in black beside.
    """
    first = next(iter(groups.values()))
    geometry = first.geometry
    mapped = len(geometry.detectors) >= MAPPED and first.wavelength.size > 1
    figure = Figure(figsize=(12.5 if mapped else 7.5, 4.2), dpi=120, layout="constrained")
    axes = figure.subplots(1, 1 + mapped, squeeze=False)[0]
    for number, (name, spectra) in enumerate(groups.items()):
        _draw(axes[0], name, spectra, f"C{number}" if len(groups) > 1 else None, first)
    against = {
        "white": "reflectance (% of a white standard)",
        "mirror": "reflectance (% of a perfect mirror)",
        "none": "collected (% of the incident light)",
    }
    axes[0].set(xlabel="wavelength (nm)", ylabel=against[first.relative])
    _scale(axes[0], *groups.values())
    if measured is not None:
        lam, value = measured[0], 100.0 * measured[1]
        axes[0].plot(lam, value, color="black", lw=1.0, label="measured")
        axes[0].set_ylim(top=max(axes[0].get_ylim()[1], 1.08 * float(value.max())))
    turned = {each.geometry.azimuth for each in groups.values()}
    azimuth = azimuth or (f"{geometry.azimuth:.4g}°" if len(turned) == 1 else EACH)
    axes[0].set_title(
        f"{title}\nlamp at {geometry.light:g}°, azimuth {azimuth}; cone of "
        f"{geometry.acceptance:g}°".strip(),
        fontsize=9,
    )
    curves = len(groups) * len(geometry.detectors)
    beside: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    axes[0].legend(fontsize=6 if mapped else 8, **(beside if curves > _FEW else {}))
    axes[0].grid(alpha=0.25)
    if mapped:
        _draw_map(figure, axes[1], first, against[first.relative])
    return figure


def _draw(axes: Axes, name: str, spectra: Spectra, colour: Any, first: Spectra) -> None:
    """Draw the curves of one group."""
    colours = colour_of(spectra)
    lam = spectra.wavelength
    for n, angle in enumerate(spectra.geometry.detectors):
        values, style = 100.0 * spectra.value[:, n], _STYLES[n % len(_STYLES)]
        drawn = colours[n] if colour is None else colour
        label = f"{name}, {angle:g}°" if name else f"detector at {angle:g}°"
        # a line has no length at a single wavelength
        marker = "o" if lam.size == 1 else ""
        axes.plot(lam, values, style, marker=marker, color=drawn, label=label)
        if spectra.error is not None:
            error = 100.0 * spectra.error[:, n]
            axes.fill_between(lam, values - error, values + error, color=drawn, alpha=0.2, lw=0)


def _scale(axes: Axes, *spectra: Spectra) -> None:
    """Set the limits of per cent: linear from 0, or logarithmic where curves are far apart."""
    value = np.concatenate([each.value for each in spectra], axis=1)
    highest = 100.0 * np.maximum(value.max(axis=0), 0.0)
    if 0.0 < _APART * highest.min() < highest.max():  # a mirror's reflection beside weak light
        axes.set_yscale("log")
        lowest = max(50.0 * float(value.min()), 1e-2 * highest.min())
        axes.set_ylim(lowest, 2.0 * highest.max())
    else:  # without rounding errors of a curve that is 0
        axes.set_ylim(0.0, max(1.08 * float(highest.max()), 1e-6))


def _draw_map(figure: Figure, axes: Axes, spectra: Spectra, label: str) -> None:
    """Draw one group's spectra over angle and wavelength."""
    order = np.argsort(spectra.geometry.detectors)
    angles = np.array(spectra.geometry.detectors)[order]
    value = 100.0 * spectra.value[:, order]
    top = max(float(value.max()), 1e-6)
    norm = LogNorm(1e-4 * top, top) if np.median(value) < top / _APART else None
    image = axes.pcolormesh(
        angles, spectra.wavelength, np.maximum(value, 1e-4 * top), norm=norm, shading="nearest"
    )
    axes.set(xlabel="detector (degrees)", ylabel="wavelength (nm)")
    figure.colorbar(image, ax=axes, label=label)
