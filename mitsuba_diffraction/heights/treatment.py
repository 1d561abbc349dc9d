"""Errors that the treatment of a scan brings, and treatments that its heights suggest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..files import FileKind, kind_of
from .field import HeightField
from .read import LoadOptions
from .source import Source

#: Ratio of the steps between medians of neighbouring rows to those of columns, from which on scan
#: lines jump. Isotropic surfaces stay within 1.5; ridges along x have correlated rows.
JUMPS = 3.0


def treatment_warning(path: Path, options: LoadOptions, field: HeightField) -> str:
    """Return a warning where making a scan periodic removed as much as it kept, or "".

    path, options : the scan, and how `field` was read.
    """
    if (
        kind_of(path) is FileKind.RECIPE
        or options.periodic in ("none", "exact")
        or not field.rms_height > 0.0
    ):
        return ""
    if not any("periodic by" in line or "tapered" in line for line in field.history):
        return ""
    raw = Source.of(path, replace(options, periodic="none")).field()
    removed = float((raw.heights - field.heights).std())
    if removed < field.rms_height:
        return ""
    return (
        f"{field.name}: making it periodic removed {removed:.3g} µm RMS and kept "
        f"{field.rms_height:.3g}: colours depend on the treatment; scan a larger area, or crop to "
        "a part whose edges meet, and compare periodic=taper and level=lines"
    )


def jumping_lines(field: HeightField) -> str:
    """Return advice where rows of a scan jump, as lines of an AFM do, or ""."""
    if not field.cut_out or any("scan lines aligned" in line for line in field.history):
        return ""
    steps = [np.diff(np.median(field.heights, axis=axis)).std() for axis in (1, 0)]
    pixels = field.pixel_size
    rows, columns = steps[0] / pixels[1], steps[1] / pixels[0]
    jumps = np.diff(np.median(field.heights, axis=1))
    # lines that jump change sign from row to row; a structure along y does not
    random = float(np.mean(jumps[1:] * jumps[:-1])) < 0.0
    if not (random and rows > JUMPS * max(columns, 1e-12)):
        return ""
    return (
        f"{field.name}: use level=lines: scan lines jump by {1e3 * steps[0]:.2g} "
        f"nm RMS from row to row, {rows / max(columns, 1e-12):.2g} times as steeply as columns; "
        "that diffracts like a grating along y"
    )
