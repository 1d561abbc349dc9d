"""Grids of numbers: NumPy's NPY files, and text with whitespace, tabs, commas or semicolons."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...columns import Columns, read_columns
from ...errors import DiffractionError, quoted, unreadable, warn
from ...limits import MOST_PIXELS
from ..field import check_pixel_count
from ..lengths import micrometres_of
from ..preprocess import LARGEST_SHARE
from . import RawHeights

# bytes of a text of so many points, x, y and height
_LARGEST = 24 * 3 * MOST_PIXELS
# Lines that Gwyddion and others put above an exported matrix: "# Width: 10.00 µm".
# Repetitions are possessive: a line of n characters takes n steps, and not n². Groups repeat
# without possession, because Python 3.11.2 matches possessive groups wrongly.
_WIDTH = "Width|Breite|Largeur|Ancho|Larghezza|Largura|Šířka|Ширина"
_HEIGHT = "Height|Höhe|Hauteur|Alto|Altura|Altezza|Výška|Высота"
_SIZE = re.compile(
    rf"[#;%\s]*+(?:({_WIDTH})|{_HEIGHT})\s*+[:=]\s*+([-+.,\deE]++)\s*+(\S++)\s*+$",
    re.IGNORECASE,
)
_OTHERS = (1e-4, 1e-3, 1e3, 1e4)  # µm in Å, nm, mm and cm
_NUMBER = re.compile(r"[-+]?[\d.]+([eE][-+]?\d+)?")
# "# Value units: nm", "# height in nm"
_STATED = re.compile(
    r"[#;%\s\"]*+(?:(?:(?:Value|Height|Z) )?units?\s*+[:=]\s*+|(?:all |the )?(?:heights?|z)"
    r"(?: values?)?(?: are| is)? in )([^\s,;\".]++)[\s,;\".]*+$",
    re.IGNORECASE,
)
# "Height [nm]", "# values in nm"; other words may be there: "# Height (retrace)"
_NAMED = re.compile(
    r"[#;%\s\"]*+(?:heights?|values?|z|topography|elevation)(?:[ _-][^\W\d_]{2,})*?"
    r"(?:\s*+[\[(]\s*+([^\s\])]++)\s*+[\])]| in (\w++))[\s,;\".:]*+$",
    re.IGNORECASE,
)


def read_npy(path: Path) -> RawHeights:
    """Read heights in µm from an NPY file of shape (ny, nx); row 0 is y = 0.

    The file is memory-mapped, so that a header with too large a shape allocates nothing; pickled
    objects, which could run code, are refused.

    Raises a DiffractionError if the file is not NPY, is truncated, or holds anything but a real
    two-dimensional array.
    """
    shown = repr(str(path))
    with unreadable(f"{shown} is not a readable NPY file"):
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
        # damaged files may hold signalling NaNs; `fill_missing` handles them
        with np.errstate(invalid="ignore"):
            heights = np.array(values, np.float64, order="C")
        heights.setflags(write=False)  # so that a HeightField need not copy it
        return RawHeights(heights)


def read_text(path: Path) -> RawHeights:
    """Read a grid of heights: one row a line, the first line the largest y, as in an image.

    Heights are in µm unless a header line gives their unit, "Value units: nm", "units: nm",
    "Height [nm]" or "heights in nm"; "Width: 10 µm" and "Height: 10 µm" give the size of the patch.
    Evenly spaced labels of columns and rows are left out.
    Empty cells and "nan" are points without data. Three columns are x, y and height, which have to
    form a regular grid, in which points may be missing; a line of names above them may give their
    units, µm without, and another order. Separators and decimal commas are as in `columns`.

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
    stated, size = _read_header(table.header.values(), shown)
    points = nx == 3 and ny > 3 and size is None  # a header with sizes belongs to a grid
    if not points:
        _refuse_names(table)
    if nx < 2 or ny < 2:
        raise DiffractionError(
            f"{shown} holds {nx} x {ny} numbers, a line scan; a height field needs a map (ny, nx)"
        )
    notes: tuple[str, ...] = ()
    if points:
        order = table.order("xy")
        x, y, height = (table.units[n] for n in order)
        scales = [_factor(unit, shown) if unit else 1.0 for unit in (x, y)]
        values, size = _from_points(values[:, order] * [*scales, 1.0], shown)
        named, stated = bool(x and y), height or stated
    else:
        values, notes = _without_labels(values, shown)
        named = size is not None
    ny, nx = values.shape
    pixel_size = (size[0] / nx, size[1] / ny) if size else None
    unit, unclear = (micrometres_of(stated), "") if stated else (1.0, _other_unit(table.header))
    return RawHeights(
        values[::-1], pixel_size, notes=notes, unit=unit, stated=stated, sized=named,
        unclear=unclear,
    )  # fmt: skip


def _without_labels(
    values: npt.NDArray[np.float64], shown: str
) -> tuple[npt.NDArray[np.float64], tuple[str, ...]]:
    """Drop the labels of columns and rows that pandas and spreadsheets write, and say so in a line.

    Raises a DiffractionError if either alone is there, which heights might be.
    """
    if _are_labels(values[0, 1:], values[1:, 1:]) and _are_labels(values[1:, 0], values[1:, 1:].T):
        line = (
            f"evenly spaced labels of columns, {values[0, 1]:g} to {values[0, -1]:g}, and rows, "
            f"{values[1, 0]:g} to {values[-1, 0]:g}, are left out; they give no pixel_size"
        )
        warn(f"{shown}: {line}")
        return values[1:, 1:], (line,)
    for what, labels, others in (
        ("line", values[0], values[1:]), ("column", values[:, 0], values[:, 1:].T),
    ):  # fmt: skip
        if _are_labels(labels, others):
            raise DiffractionError(
                f"{shown}: the first {what} of numbers is {labels[0]:g}, {labels[1]:g}, "
                f"{labels[2]:g}, ... {labels[-1]:g}, labels and no heights; leave it out (pandas: "
                "to_csv(..., header=False, index=False))"
            )
    return values, ()


def _are_labels(numbers: npt.NDArray[np.float64], others: npt.NDArray[np.float64]) -> bool:
    """Whether numbers (n,) are evenly spaced, and the lines beside them, (m, n), in no such steps.

    Heights of a ramp, a sawtooth or z = x y have lines of even or the same steps beside them.
    """
    if len(numbers) < 4 or not _are_even(step := np.diff(numbers)):
        return False
    steps = np.diff(others, axis=1)
    usual = np.median(np.abs(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0
    alike = math.isclose(usual, abs(step.mean()), rel_tol=0.01)
    return not alike and _are_even(steps).mean() < 0.5


def _are_even(steps: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Whether steps (..., n) are the same and not 0; rounded numbers differ by 1 % of a step."""
    mean = np.abs(steps.mean(axis=-1))
    return np.asarray((mean > 0.0) & (np.ptp(steps, axis=-1) <= 0.01 * mean))


def _refuse_names(table: Columns) -> None:
    """Raise a DiffractionError for a line above a grid that names columns or has lost a number.

    Comments and titles may be there.
    """
    for place, line in table.header.items():
        if line.lstrip()[0] in "#%" or _SIZE.match(line) or _stated_unit(line):
            continue
        words = re.split(r"[\s,;]+", line.strip())
        names = sum(map(bool, table.names)) > 1 and all(name in line for name in table.names)
        if names or 2 * sum(map(bool, map(_NUMBER.fullmatch, words))) > len(words):
            raise DiffractionError(
                f"{table.shown}, line {place}: {quoted(line)} is no row of numbers; expected a "
                "grid of heights in µm: delete this line, or begin it with #"
            )


def _stated_unit(line: str) -> str:
    """Return the unit of the heights that a line states, or ""."""
    if match := _STATED.match(line):
        return match[1]
    match = _NAMED.match(line)
    unit = (match[1] or match[2]) if match else ""
    return unit if micrometres_of(unit) else ""


def _other_unit(header: dict[int, str]) -> str:
    """Return the first line that names nm, Å, mm or cm, for messages, but for sizes; or ""."""
    for place, line in header.items():
        words = re.findall(r"[^\W\d_]+", line)
        if not _SIZE.match(line) and any(micrometres_of(word) in _OTHERS for word in words):
            return f"line {place}, {quoted(line.strip())}"
    return ""


def _read_header(header: Iterable[str], shown: str) -> tuple[str, tuple[float, float] | None]:
    """Return the unit of the heights, "" without, and the patch's size, µm, if stated."""
    stated = ""
    sizes: dict[str, float] = {}
    for line in header:
        if unit := _stated_unit(line):
            stated = unit
        elif match := _SIZE.match(line):
            try:
                number = float(match[2].replace(",", "."))
                sizes["width" if match[1] else "height"] = number * _factor(match[3], shown)
            except ValueError as error:
                raise DiffractionError(f"{shown}: {line.strip()!r} is not a size") from error
    if len(sizes) < 2:
        return stated, None
    size = sizes["width"], sizes["height"]
    if not all(math.isfinite(s) and s > 0 for s in size):
        raise DiffractionError(f"{shown} states a size of {size[0]:g} x {size[1]:g} µm")
    return stated, size


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

    Grid points that the file lacks are NaN, as grid points without a height are.

    Returns
    -------
    heights (ny, nx), size of the grid along x and y in µm
    """
    uneven = DiffractionError(
        f"{shown} has three columns, which are read as x, y and height (a line of names may give "
        "another order), but its points do not form a uniform grid; interpolate them to one first"
    )
    points = points[~np.isnan(points).all(axis=1)]
    xs, ix = np.unique(points[:, 0], return_inverse=True)
    ys, iy = np.unique(points[:, 1], return_inverse=True)
    once = np.unique(iy * xs.size + ix).size == len(points) > LARGEST_SHARE * xs.size * ys.size
    if not once or min(xs.size, ys.size) < 2 or not np.isfinite(points[:, :2]).all():
        raise uneven
    steps = np.diff(xs), np.diff(ys)
    if not all(map(_are_even, steps)):
        raise uneven
    grid = np.full((ys.size, xs.size), np.nan)
    grid[iy, ix] = points[:, 2]
    return grid[::-1], (float(steps[0].mean()) * xs.size, float(steps[1].mean()) * ys.size)
