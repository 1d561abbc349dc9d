"""Reading heights: checked options, choice of the reader, units, gaps and treatments."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DiffractionError, warn
from ..files import FileKind, beginning, kind_of, readable_file
from ..retired import retired_value
from ..settings import among, parameter, parameters_of
from . import preprocess
from .field import LARGE, HeightField
from .formats import RawHeights
from .formats.catalogue import way_out
from .formats.grids import read_npy, read_text
from .formats.images import read_exr, read_image
from .formats.instruments import read_instrument
from .lengths import (
    LONGEST_HEIGHT,
    LONGEST_PIXEL,
    SHORTEST_PIXEL,
    crop_of,
    height_unit_of,
    is_auto,
    micrometres_of,
    numbers_within,
    pixel_size_of,
)
from .validity import tilted

LEVELS = {
    "plane": preprocess.level_plane,
    "quadratic": preprocess.level_quadratic,
    "lines": preprocess.level_lines,
}
#: Statements about the edges of a patch.
PERIODICS = {
    "exact": "whole periods of a surface that repeats exactly",
    "open": "a part of a larger surface",
}


def _channel(value: object) -> str | int | None:
    """Check the name or index of a channel."""
    if isinstance(value, bool) or not isinstance(value, (str, int, type(None))):
        raise ValueError
    return value


def _choices(*choices: str, alone: str = "", metavar: str = "METHOD") -> dict[str, Any]:
    """Return check and allowed values of a parameter; "auto" leaves it to the file.

    alone : what to say before the choices.
    """
    check, must = among(*choices), f"{alone}one of {', '.join(map(repr, ('auto', *choices)))}"
    return {"check": lambda v: None if is_auto(v) else check(v), "must": must, "metavar": metavar}


def _number(word: str, least: float, most: float) -> Callable[[Any], float | None]:
    """Return a check for a number or numeric string; None and the word give None."""
    return lambda v: None if is_auto(v, word) else numbers_within(v, (1,), least, most)[0]


@dataclass(frozen=True)
class LoadOptions:
    """Checked parameters of `HeightField.load`; `None` means the file's value, or the default."""

    pixel_size: tuple[float, float] | None = parameter(
        None, pixel_size_of, "µm between samples; overrides what the file states",
        metavar="DX[,DY]",
    )  # fmt: skip
    max_height: float | None = parameter(
        None, _number("auto", math.ulp(0.0), LONGEST_HEIGHT),
        "µm, height of white in an image; other heights are scaled to span it from end to end",
        f"a height in µm above 0, at most {LONGEST_HEIGHT:g}, or 'auto'", "H",
    )  # fmt: skip
    height_unit: str | None = parameter(
        None, height_unit_of, "unit of the numbers in the file, e.g. nm; overrides what it states",
        "a unit of length, m, cm, mm, µm, um, nm, pm or Å, or 'auto'", "U",
    )  # fmt: skip
    channel: str | int | None = parameter(
        None, _channel, "name or index of the channel; default: the heights",
        "a channel's name or index", "C",
    )  # fmt: skip
    crop: tuple[float, ...] | None = parameter(
        None, crop_of, "size of the region to keep, µm, central or with the lower left corner X, "
        "Y; default: all", "a width or a pair (width, height) in µm, above 0, perhaps with the "
        "lower left corner, (width, height, x, y), or 'none'", "W[,H[,X,Y]]",
    )  # fmt: skip
    fill: str | None = parameter(
        None, help="points without data: nearest or harmonic; none and auto: refuse them",
        **_choices("none", *preprocess.FILLS),
    )  # fmt: skip
    level: str | None = parameter(
        None, help="surface to subtract: plane, quadratic (a scanner's arc), lines (aligned, then "
        "a plane) or none; default: plane if a tilt shows",
        **_choices("none", *LEVELS, alone="one surface (HeightField.treated subtracts another), "),
    )  # fmt: skip
    clip: float | None = parameter(
        None, _number("none", 1.0, math.inf),
        "clip heights beyond N robust standard deviations (dust)",
        "the number of standard deviations to keep, at least 1", "N",
    )  # fmt: skip
    periodic: str | None = parameter(
        None, help="edges: exact, whole periods of a surface that repeats; open, part of a larger "
        "surface; default: open, of a file", **_choices(*PERIODICS),
    )  # fmt: skip

    @classmethod
    def parse(cls, **options: Any) -> LoadOptions:
        """Check options as users write them (see `source.load`) and convert their types.

        Raises a DiffractionError if a value is not valid; the message names the parameter and the
        choices.
        """
        stated = {n: value for n, value in options.items() if not retired_value(n, value)}
        return cls(**{name: OPTIONS[name].checked(name, value) for name, value in stated.items()})

    def updated(self, other: LoadOptions) -> LoadOptions:
        """Return these options, replaced by those that `other` sets."""
        return replace(self, **other.specified())

    def specified(self) -> dict[str, Any]:
        """Return the options that are set, by name."""
        return {name: value for name, value in vars(self).items() if value is not None}


#: Parameters of `LoadOptions` by name.
OPTIONS = parameters_of(LoadOptions)

_READERS = {FileKind.IMAGE: read_image, FileKind.NPY: read_npy, FileKind.TEXT: read_text}

#: End of the history line of a treatment that nobody asked for.
BY_DEFAULT = " (by default; level=none leaves it out)"
# µm; a tilt at this wavelength is nearly one at longer wavelengths.
_SHORTEST = 0.36
_PIXELS = f"{SHORTEST_PIXEL:g} to {LONGEST_PIXEL:g} µm"

# Relative difference up to which a pixel size given by the user equals the file's: rounding.
_SAME_SIZE = 1e-3


def read_heights(
    path: str | os.PathLike[str], options: LoadOptions, kind: FileKind | None = None
) -> HeightField:
    """Read and treat the heights of a file; parameters and errors as in `HeightField.load`.

    kind : kind of the file, if it is known.
    """
    file = readable_file(path)
    raw, measured = _read(file, kind or kind_of(file), options.channel)
    field = _to_field(raw, file, options)
    # `_to_field` crops before it fills gaps
    return treated_by_default(field, replace(options, crop=None), measured)


def treated_by_default(
    field: HeightField, options: LoadOptions, measured: bool = False
) -> HeightField:
    """Treat a patch; level it by default where a tilt would turn its mirror direction.

    measured : whether an instrument wrote the file; a line then says that it is not levelled.
    """
    small = field.heights.size <= LARGE  # wider scans are cut into windows, which are levelled
    if options.level is None and options.periodic != "exact" and small and tilted(field, _SHORTEST):
        field = LEVELS["plane"](field)
        *lines, last = field.history
        field = replace(field, history=(*lines, last + BY_DEFAULT))
    elif measured and options.level in (None, "none"):
        rise = preprocess.plane_rise(field)
        line = f"not levelled: the best plane rises {rise:.3g} µm across the patch"
        field = field.changed(field.heights, line)
    return treat(field, options)


def _read(file: Path, kind: FileKind, channel: str | int | None) -> tuple[RawHeights, bool]:
    """Read the heights of a file; also return whether an instrument wrote it."""
    if kind is FileKind.JPEG:
        raise DiffractionError(f"{str(file)!r} {way_out(file, beginning(file, 8))}")
    if kind is FileKind.RESULT:
        raise DiffractionError(f"{str(file)!r} is a {kind}, which has no heights; name the scan")
    if kind in (FileKind.EXR, FileKind.TABLE):
        return read_exr(file, None if channel is None else str(channel)), False
    if kind not in _READERS:
        return read_instrument(file, channel), True
    if channel is not None:
        raise DiffractionError(
            f"{str(file)!r} has no channels to choose from; leave channel={channel} out"
        )
    return _READERS[kind](file), False


def _to_field(raw: RawHeights, file: Path, options: LoadOptions) -> HeightField:
    """Scale to µm, crop and fill the heights of a file; the user's lengths override the file's."""
    shown = repr(str(file))
    scale, pixel_size, lines = _lengths(raw, shown, options)
    with np.errstate(over="ignore", invalid="ignore"):  # HeightField refuses infinite heights
        values = raw.values if scale == 1.0 else raw.values * np.float64(scale)
    notes = (*raw.notes, *lines)
    if options.crop is not None:
        values, line = preprocess.part_of(values, pixel_size, options.crop, shown)
        notes = (*notes, line) if line else notes
    heights = np.ascontiguousarray(values, dtype=np.float64)
    heights, note = preprocess.fill_missing(heights, fill_method(options), shown)
    if heights.base is None and heights is not raw.values:
        heights.setflags(write=False)  # nothing else refers to it: HeightField need not copy it
    history = (*notes, note) if note else notes
    stated = [] if options.pixel_size or not raw.sized else ["pixel_size"]
    if options.height_unit is not None or (raw.stated and options.max_height is None):
        stated.append("heights")
    return HeightField(
        heights, pixel_size, name=file.name, history=history, cut_out=True, stated=stated
    )


def fill_method(options: LoadOptions) -> str | None:
    """Return the method that fills points without data; None refuses them."""
    return None if options.fill == "none" else options.fill


def _lengths(
    raw: RawHeights, shown: str, options: LoadOptions
) -> tuple[float, tuple[float, float], list[str]]:
    """Combine lengths of the file with lengths from options; warn of overrides.

    Returns
    -------
    µm per unit of the values, the pixel size (µm), and one line for each length that an option
    states or overrides.
    """
    pixel_size = options.pixel_size or raw.pixel_size
    scale, lines = _height_scale(raw, shown, options, pixel_size is None)
    if pixel_size is None:
        raise _missing_lengths(shown, False, True)
    stated = raw.pixel_size
    if not all(SHORTEST_PIXEL <= size <= LONGEST_PIXEL for size in pixel_size):
        assumed = "" if raw.sized else " (x and y have no unit and are read as µm)"
        metres = [1e6 * size for size in pixel_size]
        hint = "{:g},{:g}".format(*metres) if min(metres) >= SHORTEST_PIXEL else ""
        raise DiffractionError(
            f"{shown} states pixels of {pixel_size[0]:.4g} x {pixel_size[1]:.4g} µm{assumed}, not "
            f"{_PIXELS}; give pixel_size in µm, and height_unit"
            + (f": of lengths in metres pixel_size={hint} height_unit=m" if hint else "")
        )
    if stated is not None and not np.allclose(pixel_size, stated, rtol=_SAME_SIZE, atol=0):
        lines.append(
            f"pixel_size overrides the file's: pixels of {pixel_size[0]:.6g} x "
            f"{pixel_size[1]:.6g} µm, not {stated[0]:.6g} x {stated[1]:.6g} µm"
        )
    for line in lines:
        warn(f"{shown}: {line}")
    if options.height_unit is not None and not raw.stated:
        lines.append(f"heights in {options.height_unit}, as height_unit states")
    return scale, pixel_size, lines


def _height_scale(
    raw: RawHeights, shown: str, options: LoadOptions, lacks_pixel: bool
) -> tuple[float, list[str]]:
    """Return µm per unit of the values, and one line for each override of the file's unit."""
    max_height, unit = options.max_height, options.height_unit
    if unit is not None and (raw.relative or max_height is not None):
        raise DiffractionError(
            f"{shown}: height_unit {unit!r} is for heights that are numbers of a unit, without "
            "max_height; grey levels of an integer image have none: give max_height in µm alone"
        )
    if raw.relative:
        if max_height is None:
            raise _missing_lengths(shown, True, lacks_pixel)
        return max_height, []
    stated = f", not {raw.stated}" if raw.stated else ""
    if unit is not None:
        scale = micrometres_of(unit)
        assert scale is not None  # LoadOptions checks it
        same = raw.unit is not None and math.isclose(scale, raw.unit)
        if same or not raw.stated:
            return scale, []
        return scale, [f"height_unit overrides the file's: in {unit}{stated}"]
    if max_height is not None:
        known = raw.values[np.isfinite(raw.values)]
        with np.errstate(over="ignore"):
            span = float(np.ptp(known)) if known.size else 0.0
        if not span > 0.0:
            raise DiffractionError(f"{shown} is flat: max_height cannot scale it; leave it out")
        line = f"max_height overrides the file's unit{stated}: heights span {max_height:g} µm"
        return max_height / span, [line]
    if raw.unit is None:
        unit_stated = (
            f"states the unit {raw.stated!r}, not a length," if raw.stated else "states no unit"
        )
        raise DiffractionError(
            f"{shown} {unit_stated} for its heights; give height_unit, and pixel_size in µm if "
            "that is missing, too, for instance height_unit=nm pixel_size=0.05"
        )
    if raw.unclear:
        return raw.unit, [
            f"heights are read as µm; is their unit in {raw.unclear}? Give height_unit"
        ]
    return raw.unit, []


def _missing_lengths(shown: str, height: bool, pixel: bool) -> DiffractionError:
    """Return the error of a file without the height of white, or without pixel size, or both."""
    known = (
        (height, "how high white is", "max_height", "0.375"),
        (pixel, f"how large a pixel is, {_PIXELS}", "pixel_size", "0.05"),
    )
    lacks, names, values = zip(*(words for missing, *words in known if missing), strict=True)
    examples = dict(zip(names, values, strict=True)).items()
    options = " ".join(f"{name}={value}" for name, value in examples)
    what = " is an image of grey levels and" if height else ""
    return DiffractionError(
        f"{shown}{what} does not say {' nor '.join(lacks)}; give {' and '.join(names)} in µm, for "
        f"instance {options}"
    )


def treat(field: HeightField, options: LoadOptions) -> HeightField:
    """Crop, level and clip, in this order: clipping needs a level surface."""
    if options.crop is not None:
        field = preprocess.crop(field, options.crop)
    if options.level not in (None, "none"):
        field = LEVELS[options.level](field)
    if options.clip is not None:
        field = preprocess.clip_outliers(field, options.clip)
    if options.periodic is not None:
        exact, line = options.periodic == "exact", f"taken for {PERIODICS[options.periodic]}"
        field = field.changed(field.heights, line, cut_out=not exact, periodic=exact)
    return field
