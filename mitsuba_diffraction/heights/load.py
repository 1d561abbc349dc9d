"""Loading a height field from any file, and treating one in memory."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..settings import TableSettings
from .field import HeightField
from .lengths import Crop, Height, PixelSize
from .read import LoadOptions, treat
from .source import Source
from .validity import UNRELIABLE


def load(
    path: str | os.PathLike[str],
    *,
    pixel_size: PixelSize | None = None,
    max_height: Height | None = None,
    height_unit: str | None = None,
    channel: str | int | None = None,
    crop: Crop | None = None,
    fill: str | None = None,
    level: str | None = None,
    clip: float | str | None = None,
    periodic: str | None = None,
) -> HeightField:
    """Read a height field from an image, an array, text, an instrument file or a recipe.

    Raises a DiffractionError if the file cannot be read as heights, a length is missing or
    contradicts the file, or an option has no valid value.

    Parameters
    ----------
    path
        PNG, BMP or TIFF (grey, 8 or 16 bits, or 32-bit float in µm), EXR (one channel, µm),
        NPY (µm), TXT or CSV (a grid of heights in µm), TOML (a recipe), or an instrument
        file, which needs the extra `afm`.
    pixel_size
        µm, one number, a pair (dx, dy), or a string of either. `None` and "auto" leave it to
        the file; otherwise it overrides what the file states, and a warning and `history` say so.
    max_height
        Full scale of an integer image in µm: black is 0, white is `max_height`. Other heights are
        scaled so that they span it from lowest to highest, whatever unit the file states.
    height_unit
        Unit of the numbers in the file, "nm" for instance, whatever the file states; not for
        integer images.
    channel
        Name or index of the channel of an instrument file (name for an EXR); by default the
        one that holds heights.
    crop
        Crop to a central region (µm): one number for a square, a pair (width, height); or to one
        elsewhere, (width, height, x, y) with its lower left corner; or a string of these.
    fill
        Method to fill points without data: "nearest" or "harmonic" (see
        `preprocess.fill_missing`); by default they are refused.
    level
        "plane" subtracts the best plane, "lines" aligns the scan lines first; "none". By default
        "plane" where a tilt shows once the patch is tiled (`validity.tilted`).
    clip
        Clip heights to this many robust standard deviations; default not at all.
    periodic
        "exact" states that the patch is whole periods of a surface that repeats, "open" that it is
        a part of a larger surface, which is seen through windows (`tables.build.screens`). Files
        are open, unless they say otherwise. The treatments are applied in the order crop, fill,
        level, clip, and each leaves a line in `history`.
    """
    options = LoadOptions.parse(
        pixel_size=pixel_size, max_height=max_height, height_unit=height_unit, channel=channel,
        crop=crop, fill=fill, level=level, clip=clip, periodic=periodic,
    )  # fmt: skip
    return Source.of(path, options).field()


def notes_line(
    lines: Sequence[str],
    path: str | os.PathLike[str],
    options: LoadOptions,
    settings: TableSettings,
) -> str:
    """Return the number of notes on a file, and the command that prints them, in one line.

    A warning that the colours are not reliable stands there in full.

    Parameters
    ----------
    lines : the notes; without any the line is empty.
    path, options, settings : the file, and how its heights are read and its table is built.
    """
    if not lines:
        return ""
    values = options.specified()
    if settings.coherence_width != "auto":
        values["coherence_width"] = settings.coherence_width
    words = ["mitsuba-diffraction", "info", os.fspath(path)]
    if settings.wavelength_range != TableSettings.wavelength_range:
        words += ["--wavelength-range", "{:g}:{:g}".format(*settings.wavelength_range)]
    for name, value in values.items():
        numbers = value if isinstance(value, tuple) else (value,)
        text = ",".join(n if isinstance(n, str) else f"{n:.9g}" for n in numbers)
        words += [f"--{name.replace('_', '-')}", text]
    number = "1 note" if len(lines) == 1 else f"{len(lines)} notes"
    grave = "".join(f"{line}; " for line in lines if UNRELIABLE in line)
    return f"{grave}{number} on '{Path(path).name}': {shlex.join(words)}"


def treated(
    field: HeightField,
    *,
    crop: Crop | None = None,
    level: str | None = None,
    clip: float | str | None = None,
    periodic: str | None = None,
) -> HeightField:
    """Return the patch with its heights treated; parameters and order as in `load`.

    Points without data are filled while loading, since a HeightField has none.

    Raises a DiffractionError if an option has no valid value, or `clip` finds more than half of the
    heights equal.
    """
    return treat(field, LoadOptions.parse(crop=crop, level=level, clip=clip, periodic=periodic))
