"""Images that users name, opened in formats that Pillow decodes by itself.

Pillow opens more formats than these; for PostScript (EPS) it runs Ghostscript on the content.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from PIL import EpsImagePlugin, Image, UnidentifiedImageError

from .atomic import atomic_path
from .errors import DiffractionError, unreadable
from .files import SOFTWARE, readable_file
from .limits import check_content

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Formats of images, in Pillow's names; the content decides, not the suffix.
FORMATS = ("PNG", "JPEG", "BMP", "DIB", "GIF", "TIFF", "WEBP")


@contextlib.contextmanager
def without_programs() -> Iterator[None]:
    """Keep Pillow from running Ghostscript for packages that open images of every format."""
    before = EpsImagePlugin.gs_binary
    EpsImagePlugin.gs_binary = False
    try:
        yield
    finally:
        EpsImagePlugin.gs_binary = before


def open_image(
    file: str | os.PathLike[str] | IO[bytes], formats: tuple[str, ...] = FORMATS
) -> Image.Image:
    """Return an image before its pixels are decoded.

    Raises an UnidentifiedImageError, an OSError, if the content is of another format; a
    DiffractionError if a file is small, and its pixels as numbers of 8 bytes are many.
    """
    name = "an image" if not isinstance(file, str | os.PathLike) else repr(os.fspath(file))
    try:
        image = Image.open(file, formats=formats)
    except UnidentifiedImageError as error:
        raise UnidentifiedImageError(f"its format is none of {', '.join(formats)}") from error
    except Image.DecompressionBombError as error:
        raise DiffractionError(f"{name} is too large: {error}") from error
    if image.format == "TIFF":
        # Pillow 13 would map it into memory, with the sides that it has after its tag turned it
        image.filename = ""
    if isinstance(file, str | os.PathLike):
        try:
            check_content(8.0 * image.width * image.height, os.path.getsize(file), name)
        except DiffractionError:
            image.close()
            raise
    return image


def read_picture(path: Path) -> Image.Image:
    """Return a picture, decoded.

    Raises a DiffractionError if the file cannot be read as one.
    """
    readable_file(path)
    with unreadable(f"'{path}' cannot be read as a picture"), open_image(path) as picture:
        return picture.copy()


def save_figure(path: Path, figure: Figure, **how: Any) -> None:
    """Write a figure in the format of the suffix; `files.kind_of` tells a PNG from scans.

    how : more arguments of `matplotlib.figure.Figure.savefig`.

    Raises a DiffractionError if the file cannot be written.
    """
    name = path.suffix[1:].lower()
    metadata = {"Software": SOFTWARE} if name == "png" else None
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format=name, metadata=metadata, **how)
