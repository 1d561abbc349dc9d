"""Tables of docs/formats.md, which `info --formats` prints.

python -m docs.make.figures.formats -o docs
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from mitsuba_diffraction.heights.formats.catalogue import sections

from . import pages
from .pages import option, program


def tables() -> str:
    """Return the tables with their titles as headings."""
    parts = []
    for title, rows in sections().items():
        columns = [c for c in rows[0] if any(row[c] != "none" for row in rows)]
        marks = {"format": "**", "suffixes": "`"}
        cells = [
            tuple(f"{(m := marks.get(c, ''))}{r[c]}{m}".replace("none", "") for c in columns)
            for r in rows
        ]
        parts += [f"## {title.capitalize()}", pages.table(tuple(columns), cells)]
    return re.sub(r"(--[a-z][a-z-]+)", r"`\1`", "\n\n".join(part.strip() for part in parts))


@program(option("-o", "--output", type=Path, default=Path("docs"), help="of the page"))
def main(args: argparse.Namespace) -> None:
    """Write the tables into the page."""
    page = args.output / "formats.md"
    pages.update(page, {"formats": tables()})
