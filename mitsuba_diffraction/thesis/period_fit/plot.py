"""Pictures of responses (Matplotlib), wavelength along x, viewing angle along y; CSV and NPZ."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...atomic import atomic_path
from ...columns import save_rows
from .ridge import Response, Ridge

#: Dynamic range of the picture in powers of ten.
DECADES = 5.0
# The thesis' colours: yellow is bright, green is dark; ridge red, grating equation blue.
_MAP, _RIDGE, _GRATING = "viridis", "#e02020", "#3040ff"
_DASHES = (0, (4, 3))


def draw(
    axes: Axes,
    response: Response,
    ridge: Ridge | None,
    period: float | None,
    order: int = 1,
    *,
    largest: float | None = None,
) -> ScalarMappable:
    """Draw a response, its ridge if any, and the grating equation for a period in µm if any.

    largest : 1/sr, value of the brightest colour; by default the maximum of the response.

    Returns
    -------
    The colour scale, for a colour bar.
    """
    largest = float(response.values.max()) if largest is None else largest
    if not largest > 0.0:
        largest = 1.0
    norm = LogNorm(largest * 10**-DECADES, largest, clip=True)
    shown = axes.pcolormesh(
        response.wavelengths, response.angles, np.maximum(response.values.T, 1e-300),
        norm=norm, cmap=_MAP, shading="nearest", rasterized=True,
    )  # fmt: skip
    if ridge is not None:
        axes.plot(response.wavelengths, ridge.angles, color=_RIDGE, lw=1.8, label="ridge of maxima")
    if period is not None:
        expected = response.beam.grating_angles(response.wavelengths, period, order)
        label = f"grating equation, {1e3 * period:.4g} nm"
        axes.plot(response.wavelengths, expected, color=_GRATING, lw=1.3, ls=_DASHES, label=label)
    if ridge is not None or period is not None:
        axes.legend(fontsize=7, loc="lower right", framealpha=0.85)
    axes.set_xlim(response.wavelengths[0], response.wavelengths[-1])
    axes.set_ylim(response.angles[0], response.angles[-1])
    return shown


def figure(
    response: Response, ridge: Ridge | None, period: float | None, *,
    order: int, title: str, notes: str,
) -> Figure:  # fmt: skip
    """Draw one response with both curves, and their difference in degrees below."""
    result = Figure(figsize=(7.4, 7.2), dpi=110, layout="constrained")
    upper, lower = result.subplots(2, 1, height_ratios=(4, 1), sharex=True)
    shown = draw(upper, response, ridge, period, order)
    result.colorbar(shown, ax=upper, label="angle-resolved scatter f·cos θₒ  [1/sr]")
    upper.set_ylabel("viewing angle θₒ  [degrees, positive away from the light]")
    upper.set_title(
        f"{title}\nlight at θᵢ = {response.beam.theta:g}°; method {response.label}", fontsize=10
    )
    if ridge is not None and period is not None:
        difference = ridge.angles - ridge.grating_angles(period)
        lower.plot(response.wavelengths, difference, color=_RIDGE, lw=1.2)
    lower.axhline(0.0, color=_GRATING, lw=0.8, ls=_DASHES)
    lower.set(xlabel="wavelength  [nm]", ylabel="ridge less grating\nequation  [degrees]")
    result.supxlabel(notes, fontsize=8, x=0.02, ha="left")
    return result


COLUMNS = ("wavelength_nm", "ridge_deg", "grating_deg", "difference_deg", "scatter_per_sr")


def save_csv(path: str | os.PathLike[str], ridge: Ridge, period: float) -> None:
    """Write the ridge and the grating equation for a period (µm), one line per wavelength.

    Fields without a maximum, or without an order at that wavelength, are empty.
    """
    expected, wavelengths = ridge.grating_angles(period), ridge.response.wavelengths
    columns = wavelengths, ridge.angles, expected, ridge.angles - expected, ridge.heights
    lines = np.stack(columns, axis=-1).tolist()
    rows = (dict(zip(COLUMNS, line, strict=True)) for line in lines)
    save_rows(Path(path), COLUMNS, rows, digits=8)


def save_npz(
    path: str | os.PathLike[str], ridge: Ridge, period: float, entries: Mapping[str, object]
) -> None:
    """Write the response (wavelengths, angles, f·cosθo), both curves, and further `entries`."""
    response = ridge.response
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(
            stream,
            wavelengths=response.wavelengths,
            angles=response.angles,
            scatter=response.values,
            ridge=ridge.angles,
            grating=ridge.grating_angles(period),
            theta=response.beam.theta,
            phi=response.beam.phi,
            period=period,
            order=ridge.order,
            method=response.label,
            **entries,  # type: ignore[arg-type]
        )
