"""Files of tables, read and changed without the package."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.files import TABLE_ATTRIBUTE
from tests.support.directions import rough_patch

PATCH = rough_patch((24, 21), (0.08, 0.09), 0.2)
#: Every layout of coefficients: half and single floats, one component and two, intervals; and of
#: limits and windows.
KINDS: dict[str, dict[str, Any]] = {
    "power, half": {"tolerance": 1e-3},
    "power, single": {"tolerance": 1e-5},
    "chebyshev": {"basis": "chebyshev"},
    "amplitude, half": {"coherence": "patch"},
    "taylor": {"basis": "taylor"},
    "limited": {"frequency_limit": 12.0},
    "windows": {"heights": replace(PATCH, cut_out=True), "windows": 1.2},
}


def small_table(kind: str) -> DiffractionTable:
    """A small table of a kind."""
    return DiffractionTable.build(**({"heights": PATCH, "coherence_width": 1.8} | KINDS[kind]))


def document_in(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The JSON attribute of a table's file."""
    with OpenEXR.File(str(path), header_only=True) as file:
        return json.loads(file.header()[TABLE_ATTRIBUTE])


class Contents:
    """Content of a table's file, to be changed and written with a checksum that fits."""

    def __init__(self, path: Path) -> None:
        with OpenEXR.File(str(path), separate_channels=True) as exr:
            self.channels = {name: np.array(c.pixels) for name, c in exr.channels().items()}
            self.document = json.loads(exr.header()[TABLE_ATTRIBUTE])

    def write(self, path: Path) -> None:
        """Write a file in which only the content is wrong."""
        text = json.dumps(self.document)
        rows, columns = next(iter(self.channels.values())).shape
        # the order in which a reader goes through the channels
        ordered = [self.channels[name] for name in sorted(self.channels, key=_place)]
        checksum = hashlib.sha256(text.encode() + b"".join(plane.tobytes() for plane in ordered))
        header = {
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION,
            "displayWindow": (np.zeros(2, np.int32), np.array([columns - 1, rows - 1], np.int32)),
            TABLE_ATTRIBUTE: text,
            "mitsuba_diffraction_sha256": checksum.hexdigest(),
        }
        OpenEXR.File(header, self.channels).write(str(path))


def _place(channel: str) -> tuple[int, bool, int]:
    prefix, interval, term = channel.split(".")
    return int(interval), prefix == "im", int(term)
