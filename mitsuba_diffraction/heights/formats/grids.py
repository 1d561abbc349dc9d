"""Grids of numbers: NumPy's NPY files, and text with whitespace, tabs, commas or semicolons."""

from __future__ import annotations

import math
import re
import tokenize
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...columns import read_columns
from ...errors import DiffractionError, quoted
from ...limits import MOST_PIXELS
from ..field import check_pixel_count
from ..lengths import micrometres_of
from . import RawHeights, first_line

_BLOCK = 1 << 22  # values that are copied at a time

# bytes of a text of so many points, x, y and height
_LARGEST = 24 * 3 * MOST_PIXELS
# Lines that Gwyddion and others put above an exported matrix: "# Width: 10.00 µm".
# Repetitions are possessive: a line of n characters takes n steps, and not n².
_WIDTH = "Width|Breite|Largeur|Ancho|Larghezza|Largura|Šířka|Ширина"
_HEIGHT = "Height|Höhe|Hauteur|Alto|Altura|Altezza|Výška|Высота"
_SIZE = re.compile(
    rf"[#;%\s]*+(?:({_WIDTH})|{_HEIGHT})\s*+[:=]\s*+([-+.,\deE]++)\s*+(\S++)\s*+$",
    re.IGNORECASE,
)
_VALUES = re.compile(
    r"[#;%\s]*+(?:(?:Value|Height|Z) )?units?\s*+[:=]\s*+(\S++)\s*+$", re.IGNORECASE
)


def read_npy(path: Path) -> RawHeights:
    """Read heights in µm from an NPY file of shape (ny, nx); row 0 is y = 0.

    The file is memory-mapped, so that a header with too large a shape allocates nothing; pickled
    objects, which could run code, are refused.

    Raises a DiffractionError if the file is not NPY, is truncated, or holds anything but a real
    two-dimensional array.
    """
    shown = repr(str(path))
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
        if not isinstance(values, np.ndarray):
            raise DiffractionError(f"{shown} is an archive of arrays (NPZ); save one with np.save")
        if values.dtype.kind not in "fiu":
            raise DiffractionError(
                f"{shown} holds {values.dtype.name} values; expected real numbers in µm"
            )
        if values.ndim != 2:
            raise DiffractionError(
                f"{shown} has shape {values.shape}; expected two dimensions (ny, nx)"
            )
        check_pixel_count(values.shape[0], values.shape[1], shown)
        return RawHeights(_copied(path, values))
    except DiffractionError:
        raise
    except (
        OSError, ValueError, EOFError, SyntaxError, TypeError, KeyError, OverflowError,
        MemoryError, RecursionError, tokenize.TokenError,
    ) as error:  # fmt: skip
        raise DiffractionError(
            f"{shown} is not a readable NPY file: {first_line(error)}"
        ) from error


def _copied(path: Path, values: np.ndarray) -> np.ndarray:
    """Copy the values to a read-only array; mapping each block anew releases the previous one."""
    result = np.empty(values.shape, np.float64)
    rows = max(1, _BLOCK // values.shape[1])
    # damaged files may hold signalling NaNs; `fill_missing` handles them
    with np.errstate(invalid="ignore"):
        for start in range(0, len(result), rows):
            mapped = np.load(path, mmap_mode="r", allow_pickle=False)
            result[start : start + rows] = mapped[start : start + rows]
    result.setflags(write=False)
    return result


def read_text(path: Path) -> RawHeights:
    """Read a grid of heights: one row a line, the first line the largest y, as in an image.

    Heights are in µm unless a header line gives their unit, "Value units: nm" or "units: nm";
    "Width: 10 µm" and "Height: 10 µm" give the size of the patch. Empty cells and "nan" are points
    without data. Three columns are x, y and height, which have to form a regular grid; a line of
    names above them may give their units, µm without, and another order. Separators and decimal
    commas are as in `columns`.

    Raises a DiffractionError if a cell is not a number, rows differ in length, or a unit is not a
    length.
    """
    shown = repr(str(path))
    table = read_columns(path, _LARGEST)
    if not len(table.numbers):
        raise DiffractionError(f"{shown} has no line of numbers; expected heights in µm")
    values = table.with_gaps(range(table.numbers.shape[1]), "a grid of heights in µm")
    ny, nx = values.shape
    if nx == 2 and ny > 2 and (np.diff(values[:, 0]) > 0.0).all():
        raise DiffractionError(
            f"{shown} holds two columns, the first ascending: a profile of {ny} points; a height "
            "field needs a map (ny, nx)"
        )
    check_pixel_count(ny, nx, shown) if values.size > 3 * MOST_PIXELS else None
    unit, stated, size = _read_header(table.header.values(), shown)
    points = nx == 3 and ny > 3 and size is None  # a header with sizes belongs to a grid
    if not points:
        _refuse_names(table.header, shown)
    if nx < 2 or ny < 2:
        raise DiffractionError(
            f"{shown} holds {nx} x {ny} numbers, a line scan; a height field needs a map (ny, nx)"
        )
    pixel_size: tuple[float, float] | None
    if points:
        order = table.order("xy")
        x, y, height = (table.units[n] for n in order)
        unit, stated = (_factor(height, shown), height) if height else (unit, stated)
        units = [_factor(u, shown) if u else 1.0 for u in (x, y)]
        values, pixel_size = _from_points(values[:, order] * [*units, 1.0], shown)
    else:
        pixel_size = (size[0] / nx, size[1] / ny) if size else None
    return RawHeights(values[::-1], pixel_size, unit=unit, stated=stated)


def _refuse_names(header: dict[int, str], shown: str) -> None:
    """Raise a DiffractionError for lines above a grid that are neither comment nor size."""
    for place, line in header.items():
        if line.lstrip()[0] not in "#%" and not (_SIZE.match(line) or _VALUES.match(line)):
            raise DiffractionError(
                f"{shown}, line {place}: {quoted(line)} is no row of numbers; expected a grid of "
                "heights in µm (comments begin with '#')"
            )


def _read_header(
    header: Iterable[str], shown: str
) -> tuple[float, str, tuple[float, float] | None]:
    """Return µm per unit of the heights, the unit's name, and the patch's size, µm, if stated."""
    unit, stated = 1.0, ""
    sizes: dict[str, float] = {}
    for line in header:
        if match := _VALUES.match(line):
            unit, stated = _factor(match[1], shown), match[1]
        elif match := _SIZE.match(line):
            try:
                number = float(match[2].replace(",", "."))
                sizes["width" if match[1] else "height"] = number * _factor(match[3], shown)
            except ValueError as error:
                raise DiffractionError(f"{shown}: {line.strip()!r} is not a size") from error
    if len(sizes) < 2:
        return unit, stated, None
    size = sizes["width"], sizes["height"]
    if not all(math.isfinite(s) and s > 0 for s in size):
        raise DiffractionError(f"{shown} states a size of {size[0]:g} x {size[1]:g} µm")
    return unit, stated, size


def _factor(unit: str, shown: str) -> float:
    """Return how many µm one `unit` is."""
    micrometres = micrometres_of(unit)
    if micrometres is None:
        raise DiffractionError(
            f"{shown}: {unit!r} is not a unit of length; expected one of m, mm, µm, nm, pm, Å"
        )
    return micrometres


def _from_points(
    points: npt.NDArray[np.float64], shown: str
) -> tuple[npt.NDArray[np.float64], tuple[float, float]]:
    """Arrange points (n, 3) of x, y, height into a grid, first row the largest y.

    Returns
    -------
    heights (ny, nx), pixel size (dx, dy) in µm
    """
    uneven = DiffractionError(
        f"{shown} has three columns, which are read as x, y and height (a line of names may give "
        "another order), but its points do not form a uniform grid; interpolate them to one first"
    )
    xs, ix = np.unique(points[:, 0], return_inverse=True)
    ys, iy = np.unique(points[:, 1], return_inverse=True)
    every = np.unique(iy * xs.size + ix).size == xs.size * ys.size == len(points)
    if not every or min(xs.size, ys.size) < 2 or not np.isfinite(points[:, :2]).all():
        raise uneven
    steps = np.diff(xs), np.diff(ys)
    # coordinates printed with few digits are rounded: up to 1 % of a step is uniform
    if any(np.ptp(step) > 0.01 * step.mean() for step in steps):
        raise uneven
    grid = np.empty((ys.size, xs.size))
    grid[iy, ix] = points[:, 2]
    return grid[::-1], (float(steps[0].mean()), float(steps[1].mean()))
