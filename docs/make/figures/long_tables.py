"""Long tables of pages as CSV files beside them, with a link in their place.

python -m docs.make.figures.long_tables docs/validation/gratings.md     # of a page as it is
"""

from __future__ import annotations

import argparse
import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path

from . import pages
from .pages import option, program, write_text

#: Rows from which a table is a file.
LONG = 6
_TABLE = re.compile(r"(?:^\|.*\n)+", re.M)
# A heading, or the name of a generated part.
_TITLE = re.compile(r"^(?:#+ |<!-- begin )(.*?)(?: -->)?$", re.M)


def write_page(path: Path, text: str) -> list[Path]:
    """Write a page whose tables of `LONG` rows and more are CSV files beside it.

    Files `STEM-*.csv` that the page does not link are deleted.

    Returns
    -------
    Paths of the page and of the files.
    """
    shown, tables = separated(text, path.stem)
    for old in path.parent.glob(f"{path.stem}-*.csv"):
        if f"]({old.name})" not in shown:
            old.unlink()
    for name, content in (*tables.items(), (path.name, shown)):
        write_text(path.parent / name, content)
    return [path, *(path.parent / name for name in tables)]


def update(path: Path, parts: Mapping[str, str]) -> None:
    """Replace parts of a page by name, whose long tables are files beside it."""
    pages.update(path, parts)
    write_page(path, path.read_text(encoding="utf-8"))


def separated(text: str, stem: str) -> tuple[str, dict[str, str]]:
    """Return a page with links in place of its long tables, and the CSV files by name.

    A page with generated parts keeps the tables outside of them, which are written by hand.

    stem : beginning of the files' names; the heading or generated part of a table follows.
    """
    tables: dict[str, str] = {}
    has_parts = "<!-- begin " in text

    def replace(match: re.Match[str]) -> str:
        lines = match[0].strip().splitlines()
        rows = [_cells(line) for n, line in enumerate(lines) if n != 1]
        before = text[: match.start()]
        by_hand = has_parts and before.rfind("<!-- begin ") <= before.rfind("<!-- end ")
        if len(rows) <= LONG or by_hand:
            return match[0]
        titles = _TITLE.findall(before) or [stem]
        words = re.sub(r"[^a-z0-9]+", "-", titles[-1].lower()).strip("-")
        name, number = f"{stem}-{words}.csv", 1
        while name in tables:
            number += 1
            name = f"{stem}-{words}-{number}.csv"
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows(rows)
        tables[name] = stream.getvalue()
        columns = ", ".join(rows[0])
        return f"[Table of {len(rows) - 1} rows]({name}): {columns}.\n"

    return _TABLE.sub(replace, text), tables


def _cells(line: str) -> list[str]:
    """Return the cells of a line of a table, without Markdown's marks."""
    cells = re.split(r"(?<!\\)\|", line.strip().strip("|"))
    return [re.sub(r"[`*]", "", cell).replace("\\|", "|").strip() for cell in cells]


@program(option("pages", metavar="PAGE", type=Path, nargs="+"))
def main(args: argparse.Namespace) -> None:
    """Convert pages."""
    for page in args.pages:
        if separated(text := page.read_text(encoding="utf-8"), page.stem)[1]:
            for path in write_page(page, text):
                print(f"wrote {path}")
