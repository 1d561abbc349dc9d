"""Contact sheets: maps beside each other (Matplotlib)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from .picture import LEGEND, draw, signed
from .result import BrdfMap

_DPI = 100
_SMALLEST_SIDE = 2.3  # inches, of a map
_MOST_COLUMNS = 4


def contact_sheet(
    maps: Sequence[BrdfMap],
    titles: Sequence[str],
    *,
    title: str,
    exposure: float | None = None,
) -> Figure:
    """Maps in rows of up to four, each with its title.

    Parameters
    ----------
    maps : of colours, not of single wavelengths.
    titles : one for each; two lines at most.
    title : of the whole sheet.
    exposure : stops, for all maps alike; by default each has its own, which is then stated.
    """
    columns = min(len(maps), _MOST_COLUMNS)
    rows = math.ceil(len(maps) / columns)
    side = max(1.02 * max(m.resolution for m in maps) / _DPI, _SMALLEST_SIDE)
    width, height = (side + 0.2) * columns + 0.6, (side + 0.55) * rows + 0.8
    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    for n, (one, name) in enumerate(zip(maps, titles, strict=True)):
        row, column = divmod(n, columns)
        left, bottom = 0.6 + (side + 0.2) * column, 0.65 + (side + 0.55) * (rows - 1 - row)
        axes = figure.add_axes((left / width, bottom / height, side / width, side / height))
        stops = one.exposure() if exposure is None else exposure
        draw(axes, one, stops)
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
