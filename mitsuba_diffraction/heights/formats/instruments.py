"""Scanning-probe instrument files, through the package SurfaceTopography (extra `afm`)."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError, warn
from ..field import check_pixel_count
from . import RawHeights, first_line

# Signals that instruments record in nanometres beside the topography.
_NOT_HEIGHT = re.compile(
    r"error|amplitude|phase|deflection|friction|lateral|current|potential|adhesion|deformation"
    r"|dissipation|indentation|mask",
    re.IGNORECASE,
)
_MICROMETRE = "µm"


def read_instrument(path: Path, channel: str | int | None = None) -> RawHeights:
    """Read the topography of an instrument file, in the units that the file states.

    Parameters
    ----------
    path
        A file of any format that SurfaceTopography recognises by content: NanoScope, Gwyddion, IBW,
        NID, MI, X3P, JPK, WSxM, ...
    channel
        Index or name of the channel. By default the one that holds heights; if several do, the
        first, and a warning lists them.

    Returns
    -------
    RawHeights
        Heights in µm, rows upwards as in an image; points without data are NaN.

    Raises
    ------
    DiffractionError
        If the package is missing, the format is not recognised, the file is damaged, the units are
        unknown or not lengths, nothing in it is a height, or the data is a line scan or not on a
        uniform grid.
    """
    shown = repr(str(path))
    with warnings.catch_warnings():
        # Readers warn of fields they do not know, and of optional packages that they can do
        # without; what matters here is checked below.
        warnings.simplefilter("ignore")
        try:
            from SurfaceTopography.Exceptions import CannotDetectFileFormat
            from SurfaceTopography.IO import open_topography
        except ImportError as error:
            raise DiffractionError(
                f"{shown} is read as an instrument file, which needs SurfaceTopography: "
                "pip install 'mitsuba_diffraction[afm]'"
            ) from error
        # Some forty readers of binary formats raise whatever damaged data trips over, from
        # struct.error to AssertionError; each becomes one line with its cause attached.
        try:
            reader = open_topography(str(path))
        except CannotDetectFileFormat as error:
            raise DiffractionError(
                f"{shown} is not a height field of a known kind; expected an image (PNG, BMP, "
                "TIFF, EXR), an array (NPY), text (TXT, CSV), a recipe (TOML) or an instrument "
                "file, undamaged"
            ) from error
        except Exception as error:
            raise DiffractionError(f"{shown} cannot be read: {first_line(error)}") from error
        try:
            chosen, note, others = _choose(list(reader.channels), channel, shown)
            raw = _read_channel(reader, chosen, shown)
        except DiffractionError:
            raise
        except Exception as error:
            raise DiffractionError(
                f"{shown} ({reader.format()}) is damaged or not supported: {first_line(error)}"
            ) from error
        finally:
            reader.close()
    if others:
        warn(
            f"{shown} has several height channels; {chosen.name!r} was taken, channel= chooses "
            f"another: {others}"
        )
    raw.notes = (note,)
    return raw


def _choose(channels: list[Any], wanted: str | int | None, shown: str) -> tuple[Any, str, str]:
    """Channel to read, a line that says which, and the other height channels if there are any."""
    if not channels:
        raise DiffractionError(f"{shown} has no channel")
    listed = _list(channels)
    if wanted is not None:
        chosen = _named(channels, wanted, shown)
        return chosen, f"channel {chosen.name!r}, chosen among {listed}", ""
    heights = [c for c in channels if _is_height(c) and not _NOT_HEIGHT.search(c.name)]
    if not heights:  # whose units the user may know
        heights = [c for c in channels if c.dim == 2 and _units(c) == (None, None)]
    if not heights:
        raise _why_none(channels, shown)
    note = f"channel {heights[0].name!r}"
    if len(channels) > 1:
        note += f", the {'first' if len(heights) > 1 else 'only'} height channel among {listed}"
    return heights[0], note, _list(heights) if len(heights) > 1 else ""


def _list(channels: list[Any]) -> str:
    text = ", ".join(f"{c.index} {c.name!r}" for c in channels[:12])
    return text + (", ..." if len(channels) > 12 else "")


def _named(channels: list[Any], wanted: str | int, shown: str) -> Any:
    matches = [c for c in channels if c.name == wanted]
    if not matches and isinstance(wanted, str):
        matches = [c for c in channels if c.name.casefold() == wanted.casefold()]
    if not matches and re.fullmatch(r"\s*\d{1,6}\s*", str(wanted)):
        matches = [c for c in channels if c.index == int(wanted)]
    if not matches:
        raise DiffractionError(f"{shown}: channel {wanted!r} is not one of {_list(channels)}")
    if len(matches) > 1:
        raise DiffractionError(
            f"{shown}: several channels are called {wanted!r}; give the index: {_list(channels)}"
        )
    return matches[0]


def _why_none(channels: list[Any], shown: str) -> DiffractionError:
    """What keeps every channel from being a height map."""
    if all(c.dim == 1 for c in channels):
        return DiffractionError(f"{shown} holds line scans; a height field needs a map (ny, nx)")
    if all(c.is_uniform is False for c in channels):
        return DiffractionError(
            f"{shown} is not on a uniform grid; interpolate its points to one first"
        )
    return DiffractionError(
        f"{shown} has no height channel among {_list(channels)}; if one of them holds heights "
        "after all, name it with channel"
    )


def _units(channel: Any) -> tuple[str | None, str | None]:
    """Units (lateral, height) that a channel states; a length for both is one string there."""
    unit = channel.unit
    if isinstance(unit, (tuple, list)):
        return unit[0], unit[-1]
    return unit, channel.data_unit if channel.data_unit is not None else unit


def _in_micrometres(unit: str | None) -> float | None:
    """How many µm one `unit` is; `None` if it is not a unit of length."""
    from SurfaceTopography.Support.UnitConversion import (
        get_unit_conversion_factor,
        is_length_unit,
    )

    if not isinstance(unit, str) or not is_length_unit(unit):
        return None
    return float(get_unit_conversion_factor(unit, _MICROMETRE))


def _is_height(channel: Any) -> bool:
    lateral, height = _units(channel)
    return (
        channel.dim != 1
        and bool(channel.is_height_channel)
        and _in_micrometres(lateral) is not None
        and _in_micrometres(height) is not None
    )


def _check_map(source: Any, what: str) -> None:
    """Refuse a channel or topography that is no map on a uniform grid."""
    if source.dim == 1:
        raise DiffractionError(f"{what} is a line scan; a height field needs a map (ny, nx)")
    if source.is_uniform is False:
        raise DiffractionError(f"{what} is not on a uniform grid; interpolate it to one first")


def _read_channel(reader: Any, channel: Any, shown: str) -> RawHeights:
    what = f"{shown}, channel {channel.name!r}"
    _check_map(channel, what)
    sized = channel.physical_sizes is not None
    if channel.nb_grid_pts is not None:
        nx, ny = channel.nb_grid_pts
        check_pixel_count(ny, nx, what)
    options = {} if sized else {"physical_sizes": (1.0, 1.0)}
    topography = reader.topography(channel_index=channel.index, **options)
    _check_map(topography, what)  # some readers know only now
    lateral, height = _units(channel)
    lateral_scale = _in_micrometres(lateral)
    values = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    nx, ny = values.shape
    check_pixel_count(ny, nx, what)
    pixel_size = None
    if sized and lateral_scale is not None:
        width, length = (float(size) * lateral_scale for size in topography.physical_sizes)
        pixel_size = (width / nx, length / ny)
        if not all(math.isfinite(size) and size > 0 for size in pixel_size):
            raise DiffractionError(f"{what} states a size of {width:g} x {length:g} µm")
    # heights()[ix, iy] with iy downwards from the top of the picture, as instruments show it
    return RawHeights(
        values.T[::-1], pixel_size, unit=_in_micrometres(height), stated=str(height or "")
    )
