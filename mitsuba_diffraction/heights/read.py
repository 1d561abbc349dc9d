"""From any file that holds heights to a HeightField: which reader, which units, which treatment."""

from __future__ import annotations

import math
import numbers
import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DiffractionError, DiffractionWarning
from ..files import readable_file
from . import preprocess
from .field import HeightField
from .formats import RawHeights
from .formats.grids import read_npy, read_text
from .formats.images import is_park_tiff, read_exr, read_image
from .formats.instruments import read_instrument
from .lengths import crop_of, height_of, height_unit_of, micrometres_of, pixel_size_of

LEVELS = {"plane": preprocess.level_plane, "lines": preprocess.level_lines}
PERIODICS = {"smooth": preprocess.periodic_smooth, "taper": preprocess.periodic_taper}


@dataclass(frozen=True)
class LoadOptions:
    """Parameters of `HeightField.load`, checked; `None` leaves a thing as the file has it.

    Made with `LoadOptions.of`, which raises a DiffractionError that names the parameter and the
    choices if a value does not fit.
    """

    pixel_size: tuple[float, float] | None = None
    max_height: float | None = None
    height_unit: str | None = None
    channel: str | int | None = None
    crop: tuple[float, float] | None = None
    fill: str | None = None
    level: str | None = None
    clip: float | None = None
    periodic: str | None = None

    @classmethod
    def of(cls, **given: Any) -> LoadOptions:
        """Check the values as users write them, see `load.load`, and settle their types."""
        return cls(**{name: _CHECKS[name](value) for name, value in given.items()})

    def updated(self, other: LoadOptions) -> LoadOptions:
        """These options, with those that `other` sets in their place."""
        given = {f.name: getattr(other, f.name) for f in fields(other)}
        return replace(self, **{name: value for name, value in given.items() if value is not None})

    def given(self) -> dict[str, Any]:
        """The options that were set, by name."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if value is not None}


def _channel(value: object) -> str | int | None:
    if isinstance(value, bool) or not isinstance(value, (str, int, type(None))):
        raise DiffractionError(f"channel: expected a channel's name or index, got {value!r}")
    return value


def _choice(value: object, name: str, choices: tuple[str, ...]) -> str | None:
    if value is None:
        return None
    if not isinstance(value, str) or value not in choices:
        raise DiffractionError(
            f"{name}: expected one of {', '.join(map(repr, choices))}, got {value!r}"
        )
    return value


def _sigmas(value: object) -> float | None:
    """How many standard deviations to keep: a number or numeric string of at least 1."""
    if value is None or (isinstance(value, str) and value.strip() == "none"):
        return None
    try:
        if isinstance(value, bool) or not isinstance(value, (str, numbers.Real)):
            raise ValueError
        number = float(value)
        if not 1 <= number < math.inf:
            raise ValueError
    except (ValueError, OverflowError) as error:
        raise DiffractionError(
            f"clip: expected how many standard deviations to keep, at least 1, got {value!r}"
        ) from error
    return number


_CHECKS: dict[str, Callable[[Any], Any]] = {
    "pixel_size": pixel_size_of,
    "max_height": height_of,
    "height_unit": height_unit_of,
    "channel": _channel,
    "crop": crop_of,
    "fill": partial(_choice, name="fill", choices=("none", *preprocess.FILLS)),
    "level": partial(_choice, name="level", choices=("none", *LEVELS)),
    "clip": _sigmas,
    "periodic": partial(_choice, name="periodic", choices=("none", *PERIODICS)),
}

# What files begin with. Content decides before the suffix does, so a misnamed file still loads.
_MAGIC = (
    (b"\x89PNG\r\n\x1a\n", "image"),
    (b"II*\0", "tiff"),
    (b"MM\0*", "tiff"),
    (b"\x76\x2f\x31\x01", "exr"),
    (b"\x93NUMPY", "npy"),
    (b"\xff\xd8\xff", "jpeg"),
)
_SUFFIX = {
    ".png": "image", ".bmp": "image", ".tif": "image", ".tiff": "image", ".exr": "exr",
    ".npy": "npy", ".txt": "text", ".csv": "text", ".tsv": "text", ".xyz": "text",
    ".toml": "recipe",
}  # fmt: skip

# A file that states its pixel size wins over a parameter by no more than printing rounds it.
_SAME_SIZE = 1e-3


def read_heights(path: str | os.PathLike[str], options: LoadOptions) -> HeightField:
    """Read and treat the heights of a file; parameters and errors as in `HeightField.load`."""
    file = readable_file(path)
    raw, measured = _read(file, options.channel)
    field = _settle(raw, file, options)
    if measured and options.level in (None, "none"):
        rise = preprocess.plane_rise(field)  # seams repeat it
        line = f"not levelled: the best plane rises {rise:.3g} µm across the patch"
        field = field.changed(field.heights, line)
    return treat(field, replace(options, crop=None))  # cropped before gaps were filled


def is_recipe(path: str | os.PathLike[str]) -> bool:
    """Whether a path names a recipe: by its suffix, .toml."""
    return Path(path).suffix.lower() == ".toml"


def kind_of(file: Path) -> str:
    """What a file holds, by its content, else its suffix: "recipe" or a reader's name."""
    with file.open("rb") as stream:
        head = stream.read(8)
    for magic, kind in _MAGIC:
        if head.startswith(magic):
            return ("instrument" if is_park_tiff(file) else "image") if kind == "tiff" else kind
    if is_recipe(file):
        return "recipe"
    return _SUFFIX.get(file.suffix.lower(), "instrument")


def _read(file: Path, channel: str | int | None) -> tuple[RawHeights, bool]:
    """Heights of a file, and whether an instrument wrote it."""
    kind = kind_of(file)
    if kind == "jpeg":
        raise DiffractionError(
            f"{str(file)!r} is a JPEG, whose compression changes heights; export PNG or TIFF "
            "(8- or 16-bit grey) or numbers instead"
        )
    if kind == "instrument":
        return read_instrument(file, channel), True
    if kind == "exr":
        return read_exr(file, None if channel is None else str(channel)), False
    if channel is not None:
        raise DiffractionError(
            f"{str(file)!r} has no channels to choose from; leave channel {channel!r} out"
        )
    reader = {"image": read_image, "npy": read_npy, "text": read_text}[kind]
    return reader(file), False


def _settle(raw: RawHeights, file: Path, options: LoadOptions) -> HeightField:
    """Combine what the file says with what the user says, who is right, and refuse gaps."""
    shown = repr(str(file))
    scale, pixel_size, overrides = _lengths(raw, shown, options)
    with np.errstate(over="ignore", invalid="ignore"):  # damage, which is found below
        values = raw.values if scale == 1.0 else raw.values * np.float64(scale)
    notes = (*raw.notes, *overrides)
    if options.crop is not None:
        before = (values.shape[0], values.shape[1])
        values = values[preprocess.middle(before, pixel_size, options.crop, shown)]
        if values.shape != before:
            after = (values.shape[0], values.shape[1])
            notes = (*notes, preprocess.crop_line(before, after, pixel_size))
    heights = np.ascontiguousarray(values, dtype=np.float64)
    method = None if options.fill == "none" else options.fill
    heights, note = preprocess.fill_missing(heights, method, shown)
    if heights.base is None and heights is not raw.values:
        heights.setflags(write=False)  # ours alone: HeightField need not copy it
    history = (*notes, note) if note else notes
    return HeightField(heights, pixel_size, name=file.name, history=history, cut_out=True)


def _lengths(
    raw: RawHeights, shown: str, options: LoadOptions
) -> tuple[float, tuple[float, float], list[str]]:
    """µm of one unit of the values, the pixel size in µm, and what the options override."""
    pixel_size = options.pixel_size or raw.pixel_size
    scale, lines = _height_scale(raw, shown, options, pixel_size is None)
    if pixel_size is None:
        raise _missing_lengths(shown, False, True)
    stated = raw.pixel_size
    if stated is not None and not np.allclose(pixel_size, stated, rtol=_SAME_SIZE, atol=0):
        lines.append(
            f"pixel_size overrides the file's: pixels of {pixel_size[0]:.6g} x "
            f"{pixel_size[1]:.6g} µm, not {stated[0]:.6g} x {stated[1]:.6g} µm"
        )
    for line in lines:
        warnings.warn(f"{shown}: {line}", DiffractionWarning, stacklevel=2)
    return scale, pixel_size, lines


def _height_scale(
    raw: RawHeights, shown: str, options: LoadOptions, lacks_pixel: bool
) -> tuple[float, list[str]]:
    """µm of one unit of the values, and what the options override."""
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
        return scale, [] if same else [f"height_unit overrides the file's: in {unit}{stated}"]
    if max_height is not None:
        known = raw.values[np.isfinite(raw.values)]
        with np.errstate(over="ignore"):
            span = float(np.ptp(known)) if known.size else 0.0
        if not span > 0.0:
            raise DiffractionError(f"{shown} is flat: there is nothing that max_height could scale")
        line = f"max_height overrides the file's unit{stated}: heights span {max_height:g} µm"
        return max_height / span, [line]
    if raw.unit is None:
        what = f"states heights in {raw.stated!r}, no length" if raw.stated else "states no unit"
        raise DiffractionError(
            f"{shown} {what} for its heights; give height_unit, and pixel_size in µm if that is "
            "missing, too, for instance --height-unit nm --pixel-size 0.05"
        )
    return raw.unit, []


def _missing_lengths(shown: str, height: bool, pixel: bool) -> DiffractionError:
    """What to say of an image that lacks the height of white, or of heights without pixel size."""
    known = (
        (height, "how high white is", "max_height", "0.375"),
        (pixel, "how large a pixel is", "pixel_size", "0.05"),
    )
    lacks, names, values = zip(*(words for missing, *words in known if missing), strict=True)
    examples = dict(zip(names, values, strict=True)).items()
    options = " ".join(f"--{name.replace('_', '-')} {value}" for name, value in examples)
    parameters = " ".join(f"-D {name}={value}" for name, value in examples)
    what = " is an image of grey levels and" if height else ""
    return DiffractionError(
        f"{shown}{what} does not say {' nor '.join(lacks)}; give {' and '.join(names)} in µm, for "
        f"instance {options} (for a scene that has them as parameters, {parameters})"
    )


def treat(field: HeightField, options: LoadOptions) -> HeightField:
    """Crop, level, clip and make periodic: dust stands out from a level surface only."""
    if options.crop is not None:
        field = preprocess.crop(field, options.crop)
    if options.level not in (None, "none"):
        field = LEVELS[options.level](field)
    if options.clip is not None:
        field = preprocess.clip_outliers(field, options.clip)
    if options.periodic not in (None, "none"):
        field = PERIODICS[options.periodic](field)
    return field
