"""Grids of numbers: NumPy's NPY files, and text with whitespace, tabs, commas or semicolons."""

from __future__ import annotations

import math
import re
import tokenize
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...errors import DiffractionError
from ...limits import MOST_PIXELS, bounded_lines
from ..field import check_pixel_count
from ..lengths import micrometres_of
from . import RawHeights, first_line

_BLOCK = 1 << 22  # values that are copied at a time

_MISSING = {"", "nan", "na", "n/a", "bad", "none", "null", "-", "--", "inf", "-inf"}
# Lines that Gwyddion and others put above an exported matrix: "# Width: 10.00 µm".
# Repetitions are possessive: a line of n characters takes n steps, and not n².
_SIZE = re.compile(
    r"[#;%\s]*+(Width|Height)\s*+[:=]\s*+([-+.\deE]++)\s*+(\S++)\s*+$", re.IGNORECASE
)
_VALUES = re.compile(r"[#;%\s]*+Value units\s*+[:=]\s*+(\S++)\s*+$", re.IGNORECASE)


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

    Heights are in µm unless a header line says "Value units: nm"; "Width: 10 µm" and
    "Height: 10 µm" give the size of the patch. Empty cells and "nan" are points without data.
    Three columns are x, y (µm) and height, which have to form a regular grid. With semicolons or
    tabs between numbers, a comma is a decimal comma.

    Raises a DiffractionError if a cell is not a number, rows differ in length, or a unit is not a
    length.
    """
    shown = repr(str(path))
    try:
        with path.open(encoding="utf-8-sig") as stream:
            rows, header = _parse(bounded_lines(stream, shown), shown)
    except UnicodeDecodeError as error:
        raise DiffractionError(f"{shown} is not text (UTF-8)") from error
    except OSError as error:
        raise DiffractionError(f"cannot read {shown}: {error.strerror}") from error
    if not rows:
        raise DiffractionError(f"{shown} has no line of numbers")
    values = np.array(rows)
    pixel_size: tuple[float, float] | None
    if np.isnan(values[:, -1]).all():
        values = values[:, :-1]  # a separator at the end of every line, not a column
    unit, stated, size = _read_header(header, shown)
    ny, nx = values.shape
    if nx < 2 or ny < 2:
        raise DiffractionError(
            f"{shown} holds {nx} x {ny} numbers, a line scan; a height field needs a map (ny, nx)"
        )
    if nx == 3 and ny > 3 and size is None:  # a header with sizes belongs to a grid
        values, pixel_size = _from_points(values, shown)
    else:
        pixel_size = (size[0] / nx, size[1] / ny) if size else None
    return RawHeights(values[::-1], pixel_size, unit=unit, stated=stated)


def _parse(lines: Iterable[str], shown: str) -> tuple[list[list[float]], list[str]]:
    """Split text into rows of numbers and the header's lines."""
    rows: list[list[float]] = []
    header: list[str] = []
    split: Callable[[str], list[str]] | None = None
    count = 0
    for number, line in enumerate(lines, start=1):
        text = line.strip("\r\n")
        if not text.strip():
            continue
        if text.lstrip()[0] in "#%" or (not rows and (_SIZE.match(text) or _VALUES.match(text))):
            header.append(text)
            continue
        if split is None:
            split = _splitter(text)
        row = [_number(cell, number, shown) for cell in split(text)]
        if rows and len(row) != len(rows[0]):
            raise DiffractionError(
                f"{shown}, line {number}: {len(row)} numbers where the first row has "
                f"{len(rows[0])}; a grid has equally many in each"
            )
        rows.append(row)
        count += len(row)
        if count > 3 * MOST_PIXELS:
            check_pixel_count(count, count, shown)
    return rows, header


def _splitter(line: str) -> Callable[[str], list[str]]:
    """Return the function that splits lines with the separators of `line` into cells."""
    if ";" in line:
        return lambda text: text.replace(",", ".").split(";")
    if "\t" in line.strip():
        return lambda text: text.strip(" ").replace(",", ".").split("\t")
    if "," in line:
        return lambda text: text.split(",")
    return str.split


def _number(cell: str, line: int, shown: str) -> float:
    """Convert a cell of line number `line` to a float; NaN where data is missing."""
    word = cell.strip()
    if word.lower() in _MISSING:
        return math.nan
    try:
        return float(word)
    except ValueError as error:
        raise DiffractionError(
            f"{shown}, line {line}: {word[:40]!r} is not a number; expected a grid of heights in "
            "µm (comments begin with '#')"
        ) from error


def _read_header(header: list[str], shown: str) -> tuple[float, str, tuple[float, float] | None]:
    """Return µm per unit of the heights, the unit's name, and the patch's size, µm, if stated."""
    unit, stated = 1.0, ""
    sizes: dict[str, float] = {}
    for line in header:
        if match := _VALUES.match(line):
            unit, stated = _factor(match[1], shown), match[1]
        elif match := _SIZE.match(line):
            try:
                sizes[match[1].lower()] = float(match[2]) * _factor(match[3], shown)
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
        f"{shown} has three columns, which are read as x, y and height, but its points do not "
        "form a uniform grid; interpolate them to one first"
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
