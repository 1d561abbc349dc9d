"""Size of a scan by the header of a NanoScope file: a witness beside the library that reads it."""

from __future__ import annotations

import re
from pathlib import Path

from ..lengths import micrometres_of

_HEADER = 1 << 17  # bytes, more than any header
_BEGINS = (b"\\*File list", b"\\*Force file list", b"?*File list")
_IMAGE = re.compile(r"\\\*Ciao image list(.*?)(?=\\\*|\Z)", re.DOTALL)
_SIZE = re.compile(r"\\Scan Size: ([\d.eE+-]+) ([\d.eE+-]+) (~m|[^\s\\]+)", re.IGNORECASE)
_ASPECT = re.compile(r"\\Aspect ratio: ([\d.]+):([\d.]+)", re.IGNORECASE)


def stated_size(path: Path) -> tuple[float, float, str] | None:
    """Return width and height of the images, µm, and the aspect ratio as the header has it.

    The header of an image states two equal lengths and an aspect ratio, width to height, or two
    lengths that differ. None for other files, and headers without a size.
    """
    with path.open("rb") as stream:
        head = stream.read(_HEADER)
    if not head.startswith(_BEGINS):
        return None
    text = head.decode("latin-1")
    for image in _IMAGE.findall(text):
        size, aspect = _SIZE.search(image), _ASPECT.search(image) or _ASPECT.search(text)
        unit = size and micrometres_of(size[3].replace("~m", "µm"))
        if not (size and unit):
            continue
        width, height = float(size[1]) * unit, float(size[2]) * unit
        across, along = (float(aspect[1]), float(aspect[2])) if aspect else (1.0, 1.0)
        if not min(width, height, across, along) > 0.0:
            return None
        if abs(height / width - 1.0) < 1e-3:
            height = width * along / across
        return width, height, f"{across:g}:{along:g}"
    return None
