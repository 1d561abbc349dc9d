"""Renderings as JPEG files for the documentation."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError

# JPEG's default blurs single sparkling pixels; at 90 they stay, in a quarter of a PNG's size.
_QUALITIES = (90, 86, 82, 78, 74, 70, 64, 58)


def write_jpeg(
    source: Path, target: Path, *, width: int | None = None, most: int | None = None
) -> None:
    """Write a picture as JPEG.

    Parameters
    ----------
    source : a picture that Pillow reads.
    target : the JPEG.
    width : of the result in pixels; None keeps it.
    most : size in bytes that is not exceeded, at the price of quality.

    Raises
    ------
    DiffractionError
        If the source cannot be read, or the target not be written or made so small.
    """
    try:
        with Image.open(source) as opened:
            image = opened.convert("RGB")
        if width is not None:
            size = (width, round(width * image.height / image.width))
            image = image.resize(size, Image.Resampling.LANCZOS)
        for quality in _QUALITIES:
            buffer = io.BytesIO()
            image.save(buffer, format="JPEG", quality=quality, subsampling=0, optimize=True)
            if most is None or buffer.tell() <= most:
                break
        else:
            raise DiffractionError(
                f"'{target}' would have {buffer.tell()} bytes, more than {most}; render it smaller "
                "or with more samples"
            )
        with atomic_path(target) as path:
            path.write_bytes(buffer.getvalue())
    except OSError as error:
        raise DiffractionError(f"cannot make '{target}' of '{source}': {error}") from error
