"""Pictures of a rendering: EXR, linear, and PNG, for the eye."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic import atomic_path
from ..errors import DiffractionError, one_line

# Pixel formats that a screen can show, and what becomes of them in a PNG.
_SHOWN_AS = {"RGB": "RGB", "RGBA": "RGBA", "XYZ": "RGB", "XYZA": "RGBA", "Y": "Y", "YA": "YA"}


def colours_of(bitmap: Any) -> Any | None:
    """The part of a film's bitmap that a screen can show; `None` if there is none.

    Beside colours a film may hold further channels (normals, depth, ...), and a spectral film
    holds only bands.
    """
    parts = dict(bitmap.split())
    root = parts.get("<root>")
    if root is None or root.pixel_format().name not in _SHOWN_AS:
        return None
    return root


def write_exr(bitmap: Any, path: Path, metadata: Mapping[str, str | int]) -> None:
    """Write all channels, linear, in single precision, with metadata as EXR attributes."""
    for key, value in metadata.items():
        bitmap.metadata()[key] = value
    _write(bitmap, path)


def write_png(
    colours: Any, path: Path, exposure: float = 0.0, metadata: Mapping[str, str] | None = None
) -> None:
    """Write 8 bits per channel: times 2^exposure, sRGB transfer, what is beyond [0, 1] clipped.

    Parameters
    ----------
    colours : what `colours_of` returns; its alpha is premultiplied, that of the PNG is not.
    path : the file.
    exposure : stops.
    metadata : text to store with it, ASCII.
    """
    import mitsuba as mi

    values = np.array(colours, dtype=np.float32)
    has_alpha = colours.has_alpha()
    light = values[..., :-1] if has_alpha else values
    light *= np.float32(2.0**exposure)
    np.nan_to_num(values, copy=False, nan=0.0)
    exposed = mi.Bitmap(values, pixel_format=colours.pixel_format())
    transform = mi.Bitmap.AlphaTransform
    shown = exposed.convert(
        getattr(mi.Bitmap.PixelFormat, _SHOWN_AS[colours.pixel_format().name]),
        mi.Struct.Type.UInt8,
        True,
        transform.Unpremultiply if has_alpha else transform.Empty,
    )
    for key, value in (metadata or {}).items():
        shown.metadata()[key] = value
    _write(shown, path)


def count_bad(bitmap: Any) -> int:
    """How many pixels hold a NaN or an infinity."""
    return int((~np.isfinite(np.array(bitmap))).any(axis=-1).sum())


def _write(bitmap: Any, path: Path) -> None:
    with atomic_path(path) as temporary:
        try:
            bitmap.write(str(temporary))
        except RuntimeError as error:  # what Mitsuba makes of a full disk
            reason = one_line(str(error)).rpartition(": ")[2]
            raise DiffractionError(
                f"cannot write '{path}': {reason}; nothing was left behind"
            ) from error
