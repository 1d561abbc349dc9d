"""Files of a survey: rows as CSV, and contact sheets of the maps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ..columns import save_rows
from ..images import open_image, save_figure

SHEET = "sheet"
#: Columns of a scan's files by suffix.
FILES = {".exr": "table", ".png": "map"}
_COLUMNS, _ROWS = 6, 8  # maps in a contact sheet


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV; columns that name a file, and the reason, come first."""
    columns = dict.fromkeys(name for row in sorted(rows, key=len, reverse=True) for name in row)
    first = ("file", "sample", "reason")
    names = [*first, *(name for name in columns if name not in first)]
    save_rows(path, names, rows)


def write_sheets(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write contact sheets of all maps."""
    per_page = _COLUMNS * _ROWS
    measured = [row for row in rows if not row["reason"]]
    for page in range(math.ceil(len(measured) / per_page)):
        name = SHEET if len(measured) <= per_page else f"{SHEET}-{page + 1:03d}"
        sheet = _sheet(folder, measured[page * per_page : (page + 1) * per_page])
        save_figure(folder / f"{name}.png", sheet)


def _iridescence(row: Mapping[str, Any]) -> str:
    """Text of an iridescence index and of its value expected by chance."""
    index, chance = row["iridescence"], row["iridescence_by_chance"]
    beyond = "" if row["iridescent_light"] != "" else ": none"
    return f"iridescence {index:.2g}, by chance {chance:.2g}{beyond}"


def _sheet(folder: Path, rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw a contact sheet: maps with file name, strongest grating and iridescence."""
    lines = math.ceil(len(rows) / _COLUMNS)
    figure = Figure(figsize=(2.2 * _COLUMNS, 2.7 * lines), dpi=100)
    # a map is 2.1 inches high, with a title of 0.6 above it
    figure.subplots_adjust(0.01, 0.0, 0.99, 1.0 - 0.22 / lines, 0.05, 0.286)
    for axes in figure.subplots(lines, _COLUMNS, squeeze=False).flat:
        axes.set_axis_off()  # ticks take most of the time
    for axes, row in zip(figure.axes, rows, strict=False):
        with open_image(folder / row["map"], ("PNG",)) as picture:
            axes.imshow(picture)
        period = row.get("period_1_um")
        title = "" if period is None else f"{period:.3g} µm at {row['direction_1_deg']:.0f}°, "
        crop = f", crop {row['crop']}" if row.get("crop") else ""
        axes.text(
            0.5, 1.02,
            f"{Path(row['file']).name[:34]}{crop}\n{title}{_iridescence(row)}"
            + (f"\n{row['tiling']}" if row["tiling"] else ""),
            fontsize=6, ha="center", va="bottom", transform=axes.transAxes,
        )  # fmt: skip
    return figure
