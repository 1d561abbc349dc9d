"""Grey images of heights: PNG, BMP and TIFF through Pillow, EXR through OpenEXR."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR
from PIL import Image, UnidentifiedImageError

from ...errors import DiffractionError, counted, unreadable
from ...files import read_bytes, tiff_tags
from ...images import open_image
from ...limits import check_content
from ...streams import without_chatter
from ..field import check_pixel_count
from . import RawHeights

# Full scale of Pillow's integer modes, and names of the colour modes in messages.
_FULL_SCALE = {"1": 1, "L": 255, "I;16": 65535, "I;16L": 65535, "I;16B": 65535, "I;16N": 65535}
_COLOUR = {
    "P": "palette colours", "PA": "palette colours", "LA": "a transparency channel",
    "La": "a transparency channel", "RGB": "colours (RGB)", "RGBA": "colours (RGBA)",
    "RGBa": "colours (RGBA)", "RGBX": "colours (RGB)", "CMYK": "colours (CMYK)",
    "YCbCr": "colours (YCbCr)", "LAB": "colours (Lab)", "HSV": "colours (HSV)",
}  # fmt: skip

# Tags of TIFF, and its orientations: where row 0 and column 0 of the file are (TIFF 6.0, 1992).
_PHOTOMETRIC, _ORIENTATION = 262, 274
_TURNED: dict[int, Callable[[Any], Any]] = {
    1: lambda rows: rows, 2: np.fliplr, 3: lambda rows: rows[::-1, ::-1], 4: np.flipud,
    5: np.transpose, 6: lambda rows: np.rot90(rows, -1), 7: lambda rows: rows[::-1, ::-1].T,
    8: np.rot90,
}  # fmt: skip


def read_image(path: Path) -> RawHeights:
    """Read a grey PNG, BMP or TIFF of 1, 8 or 16 bits (relative), or of floats (µm).

    Floats have 32 bits, of uncompressed TIFFs also 64.

    Eight-bit colours are read if red, green and blue are equal and no pixel is transparent. The
    image's top row is the largest y, so rows are flipped.

    Raises a DiffractionError if the file is not such an image, is damaged, has colours or several
    pages.
    """
    shown = repr(str(path))
    with unreadable(f"{shown} is damaged or incomplete"), warnings.catch_warnings():
        # The size is checked below, against a limit of our own and before anything is decoded.
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        warnings.simplefilter("ignore", UserWarning)  # damaged TIFF tags: decoding decides
        try:
            with open_image(path, ("PNG", "BMP", "DIB", "TIFF")) as image:
                return _heights_of(image, shown)
        except UnidentifiedImageError as error:
            if (doubles := _doubles(path, shown)) is not None:
                return RawHeights(doubles[::-1])
            raise DiffractionError(
                f"{shown} is not a readable PNG, BMP or TIFF image; is it damaged or misnamed?"
            ) from error


def _heights_of(image: Image.Image, shown: str) -> RawHeights:
    """Decode an opened image."""
    check_pixel_count(image.height, image.width, shown)
    mode = image.mode
    if mode == "I" and image.format == "PNG":  # Pillow's name of 16-bit grey before 10.3
        mode = "I;16"
    if getattr(image, "n_frames", 1) != 1:
        raise DiffractionError(f"{shown} has {image.n_frames} pages; save the height image alone")  # type: ignore[attr-defined]
    if mode in _COLOUR:
        return RawHeights(_grey_levels(image, shown)[::-1] / np.float64(255), relative=True)
    if mode == "F":
        return RawHeights(np.asarray(image, dtype=np.float64)[::-1])
    if mode not in _FULL_SCALE:
        raise DiffractionError(
            f"{shown} has pixels of an unsupported kind (mode {mode!r}); save it as 8- or 16-bit "
            "greyscale, or as 32-bit float in µm"
        )
    values = np.asarray(image)[::-1] / np.float64(_FULL_SCALE[mode])
    # Pillow inverts TIFFs of 8 bits and fewer whose white is 0, and none of 16
    if mode.startswith("I;16") and getattr(image, "tag_v2", {}).get(_PHOTOMETRIC) == 0:
        values = 1.0 - values
    return RawHeights(values, relative=True)


def _doubles(path: Path, shown: str) -> npt.NDArray[np.float64] | None:
    """Read an uncompressed TIFF of one channel of 64-bit floats, which Pillow cannot; else None."""
    content = read_bytes(path)
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(content[:4])
    if order is None:
        return None
    tags = tiff_tags(path)
    if (tags.get(258), tags.get(277, 1), tags.get(339)) != ((64,), 1, (3,)):
        return None
    if tags.get(259, 1) != 1 or 273 not in tags:
        raise DiffractionError(
            f"{shown} has 64-bit floats that are compressed or in tiles; save it uncompressed, "
            "or as 32-bit float in µm"
        )
    nx, ny = int(tags[256]), int(tags[257])
    check_pixel_count(ny, nx, shown)
    strips = zip(tags[273], tags[279], strict=True)
    data = b"".join(content[place : place + size] for place, size in strips)
    heights = np.frombuffer(data, f"{order}f8").reshape(ny, nx).astype(np.float64)
    return np.asarray(_TURNED.get(tags.get(_ORIENTATION, 1), _TURNED[1])(heights))


def _grey_levels(image: Image.Image, shown: str) -> npt.NDArray[np.uint8]:
    """Return the levels of a grey picture that is stored in colours, as screenshots are."""
    deep = ";16" in repr(getattr(image, "tile", ""))  # Pillow reads only eight bits of these
    colours = np.asarray(image.convert("RGBA"))
    grey = colours[..., 0]
    alike = np.array_equal(grey, colours[..., 1]) and np.array_equal(grey, colours[..., 2])
    opaque = bool((colours[..., 3] == 255).all())
    if alike and opaque and not deep:
        return grey
    why = (
        "its red, green and blue differ, as in a false-colour picture"
        if not alike
        else "part of it is transparent"
        if not opaque
        else "they have 16 bits each, of which only 8 can be read"
    )
    raise DiffractionError(
        f"{shown} has {_COLOUR[image.mode]}, and heights are one grey channel: {why}; export the "
        "heights as 8- or 16-bit greyscale or as numbers, or, if the picture is grey with a tint, "
        "convert it with Pillow: image.convert('L')"
    )


def read_exr(path: Path, channel: str | None = None) -> RawHeights:
    """Read an EXR with one channel of heights in µm; the top row is the largest y.

    `channel` names one of several channels. OpenEXR decodes all channels and parts, so files of
    several parts and files that need too much memory are refused.

    Raises a DiffractionError if the file is not an EXR, is damaged, has no pixels, several parts,
    or several channels while `channel` is `None`.
    """
    shown = repr(str(path))
    with unreadable(f"{shown} is not a readable EXR image"):
        with without_chatter():
            file = OpenEXR.File(str(path), header_only=True)
        if len(file.parts) > 1:
            raise DiffractionError(
                f"{shown} has {len(file.parts)} parts; save the one with the heights alone"
            )
        header = file.header()
        low, high = header["dataWindow"]
        names = [str(entry.name) for entry in header["channels"]]
        height, width = int(high[1] - low[1] + 1), int(high[0] - low[0] + 1)
        check_pixel_count(height, width, shown)
        check_pixel_count(height * len(names), width, f"{shown}, {counted(len(names), 'channel')}")
        check_content(8 * height * width * len(names), path.stat().st_size, shown)
        chosen = _choose_channel(names, channel, shown)
        with without_chatter(), OpenEXR.File(str(path), separate_channels=True) as file:
            pixels = file.channels()[chosen].pixels
    if pixels is None or pixels.ndim != 2:
        raise DiffractionError(f"{shown}: channel {chosen!r} has no two-dimensional pixels")
    return RawHeights(np.asarray(pixels, dtype=np.float64)[::-1])


def _choose_channel(names: list[str], channel: str | None, shown: str) -> str:
    """Return the channel that the user names, or the only one."""
    listed = ", ".join(repr(name) for name in names[:8]) + (", ..." if len(names) > 8 else "")
    if channel is not None:
        if channel not in names:
            raise DiffractionError(f"{shown}: channel {channel!r} is not one of {listed}")
        return channel
    if len(names) != 1:
        raise DiffractionError(
            f"{shown} has {len(names)} channels ({listed}); heights are one channel: name it with "
            "channel (if the file is a diffraction table, pass it as table)"
        )
    return names[0]
