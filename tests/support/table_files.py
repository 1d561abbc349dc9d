"""Files of tables, read without the package."""

from __future__ import annotations

import json
import os
from typing import Any

import OpenEXR

from mitsuba_diffraction.files import TABLE_ATTRIBUTE


def document_in(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The JSON attribute of a table's file."""
    with OpenEXR.File(str(path), header_only=True) as file:
        return json.loads(file.header()[TABLE_ATTRIBUTE])
