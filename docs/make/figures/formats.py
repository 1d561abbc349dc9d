"""Tables of docs/formats.md, which `info --formats` prints.

python -m docs.make.figures.formats -o docs
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from mitsuba_diffraction.heights.formats.catalogue import sections

from . import pages
from .pages import exit_code


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


def main(argv: Sequence[str] | None = None) -> int:
    """Write the tables into the page; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.formats")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"), help="of the page")
    page = parser.parse_args(argv).output / "formats.md"
    return exit_code("formats", lambda: pages.update(page, {"formats": tables()}))


if __name__ == "__main__":
    sys.exit(main())
