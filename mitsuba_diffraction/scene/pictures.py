"""Pictures: EXR, linear and with all channels, and PNG, for the eye."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from ..atomic import atomic_path
from ..errors import DiffractionError
from ..files import readable_file
from ..optics.display import natural
from .mitsuba_errors import reason_of

# Pixel formats that a screen can show, and what becomes of them in a PNG.
_SHOWN_AS = {"RGB": "RGB", "RGBA": "RGBA", "XYZ": "RGB", "XYZA": "RGBA", "Y": "Y", "YA": "YA"}


def read_exr(path: Path) -> Any:
    """Read the colours of an EXR as `colours_of` returns them.

    Raises a DiffractionError if the file is not an EXR, or lacks colours that a screen can show.
    """
    readable_file(path)
    if path.suffix.lower() != ".exr":
        raise DiffractionError(f"'{path}' is not an EXR; name a picture that 'render' wrote")
    try:
        colours = colours_of(mi.Bitmap(str(path)))
    except RuntimeError as error:
        raise DiffractionError(f"cannot read '{path}' as a picture: {reason_of(error)}") from error
    if colours is None:
        raise DiffractionError(
            f"'{path}' holds no colours that a screen could show; name a picture with the channels "
            "R, G, B or Y"
        )
    return colours


def check_panorama(path: Path) -> Path:
    """Return the path of a panorama after a look at the file.

    Raises a DiffractionError if the file is no picture of latitude and longitude, twice as wide as
    high, or not linear.
    """
    readable_file(path)
    try:
        picture = mi.Bitmap(str(path))
    except RuntimeError as error:
        raise DiffractionError(
            f"'{path}' is not a panorama that Mitsuba reads ({reason_of(error)}); name an HDR or "
            "EXR"
        ) from error
    width, height = picture.width(), picture.height()
    if not 1.9 <= width / height <= 2.1:
        raise DiffractionError(
            f"'{path}' has {width} x {height} pixels, but a panorama of latitude and longitude is "
            "twice as wide as high; convert it, e.g. a cube map or light probe, first"
        )
    if picture.component_format() in (mi.Struct.Type.UInt8, mi.Struct.Type.UInt16):
        raise DiffractionError(
            f"'{path}' is a picture for screens, in which the sun and lamps are cut off at white; "
            "name an HDR or EXR"
        )
    return path


def colours_of(bitmap: Any) -> Any | None:
    """Return the part of a film's bitmap that a screen can show; None if there is none.

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
    colours: Any,
    path: Path,
    exposure: float = 0.0,
    view: str = "natural",
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write 8 bits per channel: values times 2^exposure, shown by a view, sRGB's transfer curve.

    colours : result of `colours_of`; its alpha is premultiplied, the PNG's is not.
    exposure : stops.
    view : one of `optics.display.VIEWS`.
    metadata : text to store with it, ASCII.
    """
    shown_as = getattr(mi.Bitmap.PixelFormat, _SHOWN_AS[colours.pixel_format().name])
    has_alpha, transform = colours.has_alpha(), mi.Bitmap.AlphaTransform
    straight = colours.convert(
        shown_as, mi.Struct.Type.Float32, False,
        transform.Unpremultiply if has_alpha else transform.Empty,
    )  # fmt: skip
    values = np.nan_to_num(np.array(straight, dtype=np.float32), copy=False, nan=0.0)
    values = values.reshape(*values.shape[:2], -1)  # one channel has no axis
    light = values[..., :-1] if has_alpha else values
    exposed = light * 2.0 ** np.float64(exposure)
    if view == "natural":
        exposed = natural(np.broadcast_to(exposed, (*exposed.shape[:2], 3)))
    light[...] = np.clip(exposed[..., : light.shape[-1]], 0.0, 1.0)
    linear = mi.Bitmap(values, pixel_format=shown_as)
    encoded = linear.convert(shown_as, mi.Struct.Type.UInt8, True, transform.Empty)
    for key, value in (metadata or {}).items():
        encoded.metadata()[key] = value
    _write(encoded, path)


def count_bad(bitmap: Any) -> int:
    """Count the pixels that hold a NaN or an infinity."""
    return int((~np.isfinite(np.array(bitmap))).any(axis=-1).sum())


def _write(bitmap: Any, path: Path) -> None:
    formats = mi.Bitmap.FileFormat
    stream = mi.MemoryStream()  # Mitsuba's files lose the error of a full disk when they close
    bitmap.write(stream, formats.PNG if path.suffix.lower() == ".png" else formats.OpenEXR)
    with atomic_path(path) as temporary:
        temporary.write_bytes(stream.raw_buffer())
