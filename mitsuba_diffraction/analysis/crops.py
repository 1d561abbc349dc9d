"""Crops of one scan, whose differences are the scan's own repeatability."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import DiffractionError
from ..files import FileKind
from ..heights import HeightField, LoadOptions, Source
from ..heights.read import treated_by_default

#: Fewest pixels of a crop along a side.
FEWEST_PIXELS = 32


def crops_of(
    path: Path, options: LoadOptions, count: int, side: float | None = None
) -> list[HeightField]:
    """Return crops of equal size, side by side, each treated as a scan of its own.

    Raises a DiffractionError if the file is a recipe, or `count` crops have fewer than
    `FEWEST_PIXELS` a side.

    Parameters
    ----------
    path : heights of any format.
    options : how they are read and treated.
    count : crops, at least 1.
    side : of square crops, µm, of which at most `count` are returned, spread over the scan; none
        if none fits, or they are of single pixels. Without, `count` crops share the scan.
    """
    raw = options.updated(LoadOptions.parse(level="none"))
    source = Source.of(path, raw)
    if source.kind is FileKind.RECIPE:
        raise DiffractionError(f"'{path}' is a recipe; crops are cut from files of heights")
    whole = source.field()
    treatment = LoadOptions.parse(level=options.level, clip=options.clip, periodic=options.periodic)
    parts = _parts(whole, count) if side is None else _squares(whole, count, side)
    return [treated_by_default(part, treatment) for part in parts]


def _squares(whole: HeightField, count: int, side: float) -> list[HeightField]:
    """Cut at most `count` squares of more than a pixel, spread over the field."""
    nx, ny = (round(side / pixel) for pixel in whole.pixel_size)
    if not (1 < nx <= whole.shape[1] and 1 < ny <= whole.shape[0]):
        return []
    columns, rows = whole.shape[1] // nx, whole.shape[0] // ny
    cells = np.unique(np.linspace(0, columns * rows - 1, count).round().astype(int))
    # the squares lie evenly between the edges
    left = np.linspace(0, whole.shape[1] - nx, columns).round().astype(int)
    low = np.linspace(0, whole.shape[0] - ny, rows).round().astype(int)
    places = [(low[cell // columns], left[cell % columns]) for cell in cells.tolist()]
    return _cut(whole, places, (ny, nx), f", {side:g} µm")


def _parts(whole: HeightField, count: int) -> list[HeightField]:
    """Cut a field into `count` equal rectangles, nearly square."""
    width, height = whole.extent
    columns = min(count, max(1, math.ceil(math.sqrt(count * width / height) - 1e-9)))
    rows = math.ceil(count / columns)
    ny, nx = whole.shape[0] // rows, whole.shape[1] // columns
    if min(nx, ny) < FEWEST_PIXELS:
        most = (whole.shape[0] // FEWEST_PIXELS) * (whole.shape[1] // FEWEST_PIXELS)
        raise DiffractionError(
            f"crops={count}: crops of {nx} x {ny} pixels are smaller than {FEWEST_PIXELS} a side; "
            f"{whole.name} has {whole.shape[1]} x {whole.shape[0]}, enough for {max(most, 0)}"
        )
    return _cut(whole, [(n // columns * ny, n % columns * nx) for n in range(count)], (ny, nx))


def _cut(
    whole: HeightField, places: Sequence[tuple[int, int]], shape: tuple[int, int], note: str = ""
) -> list[HeightField]:
    """Cut rectangles (ny, nx) out of a field, whose lower left corners are at these pixels."""
    return [
        whole.changed(
            whole.heights[y : y + shape[0], x : x + shape[1]],
            f"crop {n} of {len(places)}{note}", cut_out=True, periodic=False,
        )
        for n, (y, x) in enumerate(places, 1)
    ]  # fmt: skip
