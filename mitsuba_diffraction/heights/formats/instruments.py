"""Reader of scanning-probe instrument files; uses SurfaceTopography (extra `afm`)."""

from __future__ import annotations

import contextlib
import re
import warnings
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError, unreadable, warn
from ...extras import optional
from ...files import beginning
from ...limits import bounded_lines, bounded_memory, check_archive, check_content
from ..field import check_pixel_count
from ..lengths import micrometres_of
from . import RawHeights
from .catalogue import way_out
from .headers import stated_sizes

# Signals that instruments record in nanometres beside the topography.
_NOT_HEIGHT = re.compile(
    r"error|amplitude|phase|deflection|friction|lateral|current|potential|adhesion|deformation"
    r"|dissipation|indentation|mask",
    re.IGNORECASE,
)
# Names of maps of heights, the last part of a path in HDF5.
_HEIGHT = re.compile(
    r"(?:^|[^a-z])(?:height\w*|topo\w*|z|surface|elevation)(?:$|[^a-z])[^/]*$", re.IGNORECASE
)
# Formats of arrays, which have no header that says how they lie.
_ARRAYS = ("h5", "mat", "npz")
#: Relative difference up to which two statements of a size are one: rounding.
_SAME_SIZE = 0.01
#: Ratio up to which two statements of the heights' span are one: programs print the span of a
#: levelled or filtered image. Units differ by more.
_SAME_SPAN = 5.0


def read_instrument(path: Path, channel: str | int | None = None) -> RawHeights:
    """Read the topography of an instrument file, in the units that the file states.

    Raises a DiffractionError if SurfaceTopography is missing, the format is unknown, the file is
    damaged, the units are unknown or not lengths, no channel holds heights, or the data is a line
    scan or not on a uniform grid.

    Parameters
    ----------
    path
        A file of any format that SurfaceTopography recognises by content: NanoScope, Gwyddion, IBW,
        NID, MI, X3P, JPK, WSxM, ...
    channel
        Index or name of the channel; by default the first that holds heights. The note lists all.

    Returns
    -------
    RawHeights
        Heights in µm, rows upwards as in an image; points without data are NaN.
    """
    shown, size = repr(str(path)), path.stat().st_size
    if known := way_out(path, beginning(path, 64)):
        raise DiffractionError(f"{shown} {known}")
    check_archive(path, shown)
    if b"\0" not in beginning(path, 1 << 16):  # text: some readers take n² steps for long lines
        with path.open(encoding="latin-1") as stream:
            deque(bounded_lines(stream, shown), maxlen=0)
    with warnings.catch_warnings(), bounded_memory(size, shown):
        # Readers warn of unknown fields and missing optional packages; units and sizes are checked
        # below.
        warnings.simplefilter("ignore")
        unknown = optional("SurfaceTopography.Exceptions", shown).CannotDetectFileFormat
        topography = optional("SurfaceTopography.IO", shown)
        # On damaged data, some forty readers of binary formats raise anything from struct.error to
        # AssertionError; each becomes one line with its cause attached.
        with unreadable(f"{shown} cannot be read"):
            try:
                reader = topography.open_topography(str(path))
            except unknown as error:
                raise _why_unknown(path, topography.readers) from error
        with (
            contextlib.closing(reader),
            unreadable(f"{shown} ({reader.format()}) is damaged or not supported"),
        ):
            chosen, note = _choose(list(reader.channels), channel, shown)
            raw = _read_channel(reader, chosen, shown, size)
            if reader.format() in _ARRAYS:
                note += "; the first index of the array runs along x, the second from the top down"
    raw.notes = (note,)
    return _witnessed(raw, path)


def _why_unknown(path: Path, readers: Sequence[Any]) -> DiffractionError:
    """Return the error of a file that no reader takes: the reason of the one it is made for."""
    shown, begins = repr(str(path)), beginning(path, 1 << 12)
    for reader in readers:
        named = path.suffix.lower().lstrip(".") in reader.file_extensions()
        if named or reader.can_read(begins).name == "YES":
            try:
                with unreadable(f"{shown} is damaged or not supported, as {reader.name()}"):
                    reader(str(path)).close()
            except DiffractionError as error:
                if type(error.__cause__).__name__ != "FileFormatMismatch":
                    return error
    return DiffractionError(
        f"{shown} is not a height field of a known kind; expected an image (PNG, BMP, TIFF, EXR), "
        "an array (NPY), text (TXT, CSV), a recipe (TOML) or an instrument file, undamaged; "
        "'mitsuba-diffraction info --formats' lists them"
    )


def _witnessed(raw: RawHeights, path: Path) -> RawHeights:
    """Compare size and heights with the file's header; its size wins, and a note says so.

    Raises a DiffractionError where the header contradicts the library and does not say which image
    it means, or about the heights.
    """
    stated = stated_sizes(path)
    if not stated or raw.pixel_size is None:
        return raw
    (ny, nx), (dx, dy) = raw.values.shape, raw.pixel_size
    read = f"{nx * dx:.4g} x {ny * dy:.4g} µm"
    sizes = [f"{s.width:.4g} x {s.height:.4g} µm{f' ({s.words})' * bool(s.words)}" for s in stated]
    fits = [s for s in stated if _same(nx * dx, s.width, nx) and _same(ny * dy, s.height, ny)]
    if not fits and len(stated) > 1:
        raise DiffractionError(
            f"{str(path)!r}: the header states {' and '.join(sizes[:4])}, and the library that "
            f"reads it {read}; export the heights as text, with their size"
        )
    span = (fits or stated)[0].span
    factor = 1.0 if raw.unit is None else raw.unit
    if span is not None and np.isfinite(raw.values).any():
        found = float(np.nanmax(raw.values) - np.nanmin(raw.values)) * factor
        if not span / _SAME_SPAN <= found <= span * _SAME_SPAN:
            raise DiffractionError(
                f"{str(path)!r}: the header states heights that span {span:.4g} µm, and the "
                f"library that reads it {found:.4g} µm; export the heights as text, with their unit"
            )
    if not fits:
        raw.pixel_size = (stated[0].width / nx, stated[0].height / ny)
        line = (
            f"the header states {sizes[0]}, and the library that reads it {read}: the header's are "
            "taken; pixel_size overrides them"
        )
        warn(f"{str(path)!r}: {line}")
        raw.notes = (*raw.notes, line)
    return raw


def _same(size: float, stated: float, pixels: int) -> bool:
    """Whether two sizes are one: to rounding, or to a pixel, if one is between the outer pixels."""
    return abs(size / stated - 1.0) < max(_SAME_SIZE, 1.01 / pixels)


def _choose(channels: list[Any], requested: str | int | None, shown: str) -> tuple[Any, str]:
    """Choose the requested channel, or the first that holds heights; say so in a line."""
    if not channels:
        raise DiffractionError(f"{shown} has no channel")
    listed = _list(channels)
    if requested is not None:
        channel = _named(channels, requested, shown)
        return channel, f"channel {channel.name!r}, chosen among {listed}"
    heights = [c for c in channels if _is_height(c) and not _NOT_HEIGHT.search(c.name)]
    if not heights:  # without units, which the user may know
        heights = _without_units(channels, shown)
    if not heights:
        raise _why_none(channels, shown)
    note = f"channel {heights[0].name!r}"
    if len(channels) > 1:
        note += f", the {'first' if len(heights) > 1 else 'only'} height channel among {listed}"
    if len(heights) > 1:
        note += "; channel chooses another"
    return heights[0], note


def _without_units(channels: list[Any], shown: str) -> list[Any]:
    """Return the maps without units, data sets of HDF5 for instance, those of heights by name.

    Raises a DiffractionError if there are several and no name says heights.
    """
    maps = [c for c in channels if c.dim == 2 and _units(c) == (None, None)]
    named = [c for c in maps if _HEIGHT.search(c.name) and not _NOT_HEIGHT.search(c.name)]
    if len(maps) > 1 and not named:
        raise DiffractionError(
            f"{shown} has {len(maps)} maps without units, and none is called height; name the one "
            f"with heights with channel: {_list(maps)}"
        )
    return named or maps


def _list(channels: list[Any]) -> str:
    """List indices and names of channels for a message, twelve at most."""
    text = ", ".join(f"{c.index} {c.name!r}" for c in channels[:12])
    return text + (", ..." if len(channels) > 12 else "")


def _named(channels: list[Any], name: str | int, shown: str) -> Any:
    """Return the channel with this name, exact or in other case, or with this index."""
    matches = [c for c in channels if c.name == name]
    if not matches and isinstance(name, str):
        matches = [c for c in channels if c.name.casefold() == name.casefold()]
    if not matches and re.fullmatch(r"\s*\d{1,6}\s*", str(name)):
        matches = [c for c in channels if c.index == int(name)]
    if not matches:
        raise DiffractionError(f"{shown}: channel {name!r} is not one of {_list(channels)}")
    if len(matches) > 1:
        raise DiffractionError(
            f"{shown}: several channels are called {name!r}; give the index: {_list(channels)}"
        )
    return matches[0]


def _why_none(channels: list[Any], shown: str) -> DiffractionError:
    """Return the error of a file without any channel of heights."""
    if all(c.dim == 1 or c.is_uniform is False for c in channels):
        _check_map(channels[0], shown)
    return DiffractionError(
        f"{shown} has no height channel among {_list(channels)}; if one of them holds heights, "
        "name it with channel"
    )


def _units(channel: Any) -> tuple[str | None, str | None]:
    """Return the units (lateral, height) of a channel; one string stands for both."""
    unit = channel.unit
    if isinstance(unit, (tuple, list)):
        return unit[0], unit[-1]
    return unit, channel.data_unit if channel.data_unit is not None else unit


def _is_height(channel: Any) -> bool:
    """Return whether a channel is a map of heights in units of length."""
    lateral, height = _units(channel)
    return (
        channel.dim != 1
        and bool(channel.is_height_channel)
        and micrometres_of(lateral or "") is not None
        and micrometres_of(height or "") is not None
    )


def _check_map(source: Any, what: str) -> None:
    """Refuse a channel or topography that is a line scan or not on a uniform grid."""
    if source.dim == 1:
        raise DiffractionError(f"{what} is a line scan; a height field needs a map (ny, nx)")
    if source.is_uniform is False:
        raise DiffractionError(f"{what} is not on a uniform grid; interpolate it to one first")


def _read_channel(reader: Any, channel: Any, shown: str, size: int) -> RawHeights:
    """Read heights, pixel size and unit of one channel of a file of `size` bytes."""
    what = f"{shown}, channel {channel.name!r}"
    _check_map(channel, what)
    sized = channel.physical_sizes is not None
    if channel.nb_grid_pts is not None:
        nx, ny = channel.nb_grid_pts
        check_pixel_count(ny, nx, what)
        check_content(8.0 * ny * nx, size, what)
    options = {} if sized else {"physical_sizes": (1.0, 1.0)}
    topography = reader.topography(channel_index=channel.index, **options)
    _check_map(topography, what)  # some readers know the grid only after reading
    lateral, height = _units(channel)
    lateral_scale = micrometres_of(lateral or "")
    values = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    nx, ny = values.shape
    check_pixel_count(ny, nx, what)
    pixel_size = None
    if sized and lateral_scale is not None:
        width, length = (float(size) * lateral_scale for size in topography.physical_sizes)
        pixel_size = (width / nx, length / ny)
    # heights()[ix, iy] with iy downwards from the top of the picture, as instruments show it
    return RawHeights(
        values.T[::-1], pixel_size, unit=micrometres_of(height or ""), stated=str(height or "")
    )
