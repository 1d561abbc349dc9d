"""Long tables of pages as CSV files beside them, with a link in their place."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path

from . import pages

#: Rows from which a table is a file.
LONG = 6
_TABLE = re.compile(r"(?:^\|.*(?:\n|\Z))+", re.M)


def update(path: Path, parts: Mapping[str, str]) -> None:
    """Replace parts of a page by name; their tables of `LONG` rows and more are CSV files.

    A file has the names of page and part. Files `PAGE-*.csv` that the page does not link are
    deleted.
    """
    tables: dict[str, str] = {}

    def link(part: str, lines: list[str]) -> str:
        rows = [_cells(line) for n, line in enumerate(lines) if n != 1]
        if len(rows) <= LONG:
            return "\n".join(lines)
        name = f"{path.stem}-{part}.csv"
        assert name not in tables, f"two long tables in the part {part}"
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows(rows)
        tables[name] = stream.getvalue()
        return f"[Table of {len(rows) - 1} rows]({name}): {', '.join(rows[0])}."

    shown = {
        part: _TABLE.sub(lambda match, part=part: link(part, match[0].splitlines()) + "\n", text)
        for part, text in parts.items()
    }
    for name, content in tables.items():
        pages.write_text(path.parent / name, content)
    pages.update(path, shown)
    text = path.read_text(encoding="utf-8")
    for old in path.parent.glob(f"{path.stem}-*.csv"):
        if f"]({old.name})" not in text:
            old.unlink()


def _cells(line: str) -> list[str]:
    """Return the cells of a line of a table, without Markdown's marks."""
    cells = re.split(r"(?<!\\)\|", line.strip().strip("|"))
    return [re.sub(r"[`*]", "", cell).replace("\\|", "|").strip() for cell in cells]
