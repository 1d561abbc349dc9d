"""Pictures of maps with axes, contact sheets (Matplotlib), and files: PNG, linear EXR."""

from __future__ import annotations

import json
import math
import os
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...images import save_figure
from ...tables import write_channels
from .hemisphere import inside
from .result import BrdfMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

#: Polar angles of the thin circles, degrees; the horizon, 90, is drawn stronger.
_CIRCLES = (30, 60)
#: Explanation of the marks that `draw` adds.
LEGEND = "+ mirror direction   ☉ light   circles: θₒ = 30°, 60°, 90°"
# Powers of ten of the false colours of one wavelength.
_DECADES = 6.0
_DPI = 100
# Margins of the axes, inches: left, right, bottom, top.
_MARGINS = (0.85, 0.35, 1.25, 0.75)
# Mean width of a letter and height of a line of the caption, inches.
_LETTER, _LINE = 0.06, 0.145
_COLOUR_BAR = 1.0
_SMALLEST_AXES = 4.8
_TEXT, _SUN = "#303030", "#e0c060"
# Radius around the mirror direction without the dot of the light.
_LOBE = 0.1
# Contact sheets: least side of a map, inches, and largest number of maps in a row.
_SMALLEST_SIDE, _MOST_COLUMNS = 2.3, 4
#: EXR attribute that describes the map, as JSON: OpenEXR stores numbers in single precision.
ATTRIBUTE = "brdf_map"


def draw(axes: Axes, brdf_map: BrdfMap, exposure: float | None = None) -> AxesImage:
    """Draw a map into axes: colours at f × 2^exposure, or false colours of one wavelength.

    Marks are circles of equal angle, the mirror direction (+), and the light (a ring with a dot).

    Parameters
    ----------
    axes : axes; the function sets limits and aspect.
    brdf_map : the map.
    exposure : stops; by default `brdf_map.exposure()`. Not used for a single wavelength.

    Returns
    -------
    The image in the axes, for a colour bar.
    """
    common: dict[str, Any] = {
        "extent": (-1, 1, -1, 1),
        "origin": "lower",
        "interpolation": "nearest",
    }
    if brdf_map.xyz is None:
        values = np.ma.masked_where(~inside(len(brdf_map.luminance)), brdf_map.luminance)
        largest = float(values.max()) or 1.0
        from matplotlib.colors import LogNorm

        lowest = largest * 10**-_DECADES
        norm, values = LogNorm(lowest, largest), np.ma.maximum(values, lowest)  # dark, not missing
        shown = axes.imshow(values, norm=norm, cmap="inferno", **common)
        axes.patch.set_visible(False)
    else:
        stops = brdf_map.exposure() if exposure is None else exposure
        shown = axes.imshow(brdf_map.srgb(stops), **common)
    ticks = (-1.0, -0.5, 0.0, 0.5, 1.0)
    axes.set(xlim=(-1.02, 1.02), ylim=(-1.02, 1.02), aspect="equal", xticks=ticks, yticks=ticks)
    _draw_marks(axes, brdf_map)
    return shown


def figure(brdf_map: BrdfMap, exposure: float | None, *, title: str, notes: str) -> Figure:
    """Draw a figure of one map, its pixels one to one unless they are few.

    Parameters
    ----------
    title : name of the surface.
    notes : last lines of the caption, for instance material and coherence.
    """
    single = brdf_map.xyz is None
    stops = brdf_map.exposure() if exposure is None else exposure
    # the axes reach 2 % beyond the map on each side
    side = max(brdf_map.resolution * 1.02 / _DPI, _SMALLEST_AXES)
    left, right, bottom, top = _MARGINS
    right += _COLOUR_BAR if single else 0.0
    noted = textwrap.wrap(notes, int((side + right) / _LETTER)) or [""]
    bottom += _LINE * (len(noted) - 1)
    width, height = left + side + right, bottom + side + top
    from matplotlib.figure import Figure

    result = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    axes = result.add_axes((left / width, bottom / height, side / width, side / height))
    image = draw(axes, brdf_map, stops)
    quantity = "f cos θₒ" if brdf_map.cosine else "f"
    axes.set_xlabel("x = sin θₒ cos φₒ")
    axes.set_ylabel("y = sin θₒ sin φₒ")
    axes.set_title(f"{title}\nlight at {brdf_map.light}", fontsize=11)
    if single:
        place = ((left + side + 0.2) / width, bottom / height, 0.18 / width, side / height)
        result.colorbar(image, cax=result.add_axes(place), label=f"{quantity}  [1/sr]")
        lines = [f"{brdf_map.bands}; {quantity} in 1/sr"]
    else:
        how = " (automatic)" if exposure is None else ""
        lines = [
            f"{brdf_map.bands}, illuminant {brdf_map.illuminant}",
            f"white is {quantity} = {2.0**-stops:.3g} /sr: exposure {signed(stops)} stops{how}",
        ]
    lines += [*noted, LEGEND]
    result.text(
        left / width, 0.08 / height, "\n".join(lines), fontsize=8, color=_TEXT, va="bottom",
        linespacing=1.3,
    )  # fmt: skip
    return result


def _draw_marks(axes: Axes, brdf_map: BrdfMap) -> None:
    """Draw circles of equal angle, the mirror direction and the light."""
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    for angle in _CIRCLES:
        radius = np.sin(np.radians(angle))
        axes.plot(radius * np.cos(turn), radius * np.sin(turn), color="#909090", lw=0.5, alpha=0.45)
    axes.plot(np.cos(turn), np.sin(turn), color=_TEXT, lw=0.8)
    (x, y, _), light = brdf_map.light.mirror, brdf_map.light.direction
    # a cross with an open middle, so that the lobe stays visible
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        axes.plot(
            [x + 0.035 * dx, x + 0.075 * dx], [y + 0.035 * dy, y + 0.075 * dy],
            color="#c0c0c0", lw=0.9, clip_on=False,
        )  # fmt: skip
    axes.plot(*light[:2], "o", ms=7, mfc="none", mec=_SUN, mew=0.9)
    if np.hypot(x - light[0], y - light[1]) > _LOBE:
        axes.plot(*light[:2], "o", ms=1.6, color=_SUN)


def signed(stops: float) -> str:
    """Return an exposure with its sign, a true minus."""
    return f"{stops:+g}".replace("-", "−")


def contact_sheet(
    maps: Sequence[BrdfMap],
    titles: Sequence[str],
    *,
    title: str,
    exposure: float | None = None,
    columns: int = _MOST_COLUMNS,
) -> Figure:
    """Draw maps in rows, each with its title.

    Parameters
    ----------
    maps : maps of colours, not of single wavelengths.
    titles : one for each map; two lines at most.
    title : title of the whole sheet.
    exposure : stops for all maps; by default, each map has its own, which its title states.
    columns : largest number of maps in a row.
    """
    from matplotlib.figure import Figure

    columns = min(len(maps), columns)
    rows = math.ceil(len(maps) / columns)
    side = max(1.02 * max(m.resolution for m in maps) / _DPI, _SMALLEST_SIDE)
    width, height = (side + 0.2) * columns + 0.6, (side + 0.55) * rows + 0.8
    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    for n, (brdf_map, name) in enumerate(zip(maps, titles, strict=True)):
        row, column = divmod(n, columns)
        left, bottom = 0.6 + (side + 0.2) * column, 0.65 + (side + 0.55) * (rows - 1 - row)
        axes = figure.add_axes((left / width, bottom / height, side / width, side / height))
        stops = brdf_map.exposure() if exposure is None else exposure
        draw(axes, brdf_map, stops)
        text = name if exposure is not None else f"{name}; {signed(stops)} stops"
        axes.set_title(text, fontsize=8)
        last = n + columns >= len(maps)
        axes.tick_params(labelsize=7, labelbottom=last, labelleft=column == 0)
        if last:
            axes.set_xlabel("x = sin θₒ cos φₒ", fontsize=7)
        if column == 0:
            axes.set_ylabel("y = sin θₒ sin φₒ", fontsize=7, labelpad=0)
    how = "" if exposure is None else f"; all at {signed(exposure)} stops"
    figure.suptitle(f"{title}{how}", fontsize=10, y=1.0 - 0.12 / height, va="top")
    figure.text(0.1 / width, 0.08 / height, LEGEND, fontsize=7, color="#303030")
    return figure


def save_png(
    brdf_map: BrdfMap,
    path: str | os.PathLike[str],
    *,
    exposure: float | None = None,
    title: str = "BRDF",
    notes: str = "",
) -> None:
    """Write a picture with axes, a title and a caption.

    Raises a DiffractionError if the file cannot be written; no half-written file is left.

    Parameters
    ----------
    exposure : stops; by default `brdf_map.exposure()`.
    title, notes : see `figure`.
    """
    save_figure(Path(path), figure(brdf_map, exposure, title=title, notes=notes))


def save_exr(
    brdf_map: BrdfMap, path: str | os.PathLike[str], *, notes: dict[str, Any] | None = None
) -> None:
    """Write linear numbers in 1/sr, in single precision, neither exposed nor clipped.

    Channels are R, G, B (linear sRGB, which may be negative) or, for a single wavelength, Y. A is
    the share of the pixel that the hemisphere covers; the other channels are premultiplied with it.
    Bands have the names of reflectances in spectral EXR files (Fichet, Pacanowski and Wilkie 2021):
    `T.550,0nm` is the band around 550 nm. The first row is the largest y.

    Raises a DiffractionError if the file cannot be written; no half-written file is left.

    notes : further entries of the JSON attribute `brdf_map`.
    """
    channels = {"A": brdf_map.coverage}
    if brdf_map.xyz is None:
        channels["Y"] = brdf_map.luminance
    else:
        linear = brdf_map.linear
        channels |= {name: linear[..., n] for n, name in enumerate("RGB")}
        if brdf_map.spectrum is not None:
            wavelengths = brdf_map.bands.wavelengths()
            names = (f"T.{f'{w:.6g}'.replace('.', ',')}nm" for w in wavelengths)
            channels |= dict(zip(names, brdf_map.spectrum, strict=True))
    document = {
        "quantity": "f cosθo" if brdf_map.cosine else "f",
        "unit": "1/sr",
        "theta": brdf_map.light.theta,
        "phi": brdf_map.light.phi,
        "wavelength_range": [brdf_map.bands.low, brdf_map.bands.high],
        "step": brdf_map.bands.width,
        "illuminant": brdf_map.illuminant,
        "samples": brdf_map.samples,
        **(notes or {}),
    }
    attributes = {ATTRIBUTE: json.dumps(document)}
    if brdf_map.spectrum is not None:
        attributes["spectralLayoutVersion"] = "1.0"
    write_channels(path, {name: rows[::-1] for name, rows in channels.items()}, attributes)
