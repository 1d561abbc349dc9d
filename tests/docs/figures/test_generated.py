"""Generated pages, parts and long tables are what the code says, and all else on a page stays."""

from __future__ import annotations

import csv
import re

import pytest

from docs.make.figures import interfaces, long_tables, pages, solved
from docs.make.figures.long_tables import LONG
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.heights.formats.catalogue import ARRAYS, OPTICAL, PROBES
from tests.support import ROOT
from tests.support.pages import PAGES, markers


@pytest.mark.parametrize("page", interfaces.PAGES)
def test_the_page_has_what_the_code_says(page):
    remedy = "python -m docs.make.figures.interfaces -o docs"
    made = interfaces.PAGES[page]()
    assert markers(PAGES[f"docs/{page}"]) == list(made)
    for name, text in made.items():
        assert pages.part(PAGES[f"docs/{page}"], name) == text, remedy


def test_every_command_has_a_place():
    grouped = {name for names in interfaces.GROUPS.values() for name in names}
    assert grouped == set(interfaces.subparsers())


def test_listed_suffixes_are_of_formats_that_the_library_reads():
    library = pytest.importorskip("SurfaceTopography.IO", reason="needs the extra afm")
    known = {suffix for reader in library.readers for suffix in reader.file_extensions()}
    listed = {suffix[1:] for entry in (*PROBES, *OPTICAL, *ARRAYS) for suffix in entry.suffixes}
    assert listed - known <= {"di"}
    # those left out are texts and tables of profiles, terrain, and what our own readers read
    own = {"txt", "asc", "xyz", "hfm", "csv", "npy", "xlsx", "zip", "hgt"}
    numbered = {"002", "003", "004", "005", "apx"}
    assert known - listed <= own | numbered


def test_the_page_has_the_numbers_of_the_shipped_tables(monkeypatch):
    monkeypatch.chdir(ROOT)

    def numbers(text: str) -> list[str]:
        rows = (line for line in text.splitlines() if line.startswith("|"))
        return [number for row in rows for number in re.findall(r"\d+(?:\.\d+)?", row)]

    made = numbers(solved.table())
    assert len(made) > 20
    assert numbers(pages.part(PAGES["docs/orders.md"], "solved")) == made


def test_a_part_is_replaced_and_all_else_stays():
    text = "a\n<!-- begin t -->\nold\n<!-- end t -->\nb\n"
    new = pages.replaced(text, "t", "new\n")
    assert new == "a\n<!-- begin t -->\nnew\n<!-- end t -->\nb\n"
    assert pages.part(new, "t") == "new"
    with pytest.raises(DiffractionError):
        pages.replaced(text + text, "t", "new")


def table_of(rows):
    lines = "".join(f"| `case {n}` | {n} % | \\|a\\| |\n" for n in range(rows))
    return f"| case | error | a |\n|---|---:|---|\n{lines}"


@pytest.fixture
def page(tmp_path):
    """A page with a long table that is written by hand, and an empty part."""
    file = tmp_path / "page.md"
    part = "<!-- begin by-depth -->\n<!-- end by-depth -->\n"
    file.write_text(f"# Page\n\n{table_of(LONG)}\n{part}\nEnd.\n", encoding="utf-8")
    return file


def test_a_long_table_is_a_file_with_the_same_cells(page):
    old = page.with_name("page-old.csv")
    old.write_text("of an earlier page")
    long_tables.update(page, {"by-depth": f"Before.\n\n{table_of(LONG)}\nBehind."})
    text = page.read_text(encoding="utf-8")
    link = f"[Table of {LONG} rows](page-by-depth.csv): case, error, a."
    assert pages.part(text, "by-depth") == f"Before.\n\n{link}\n\nBehind."
    # written by hand
    assert text.startswith(f"# Page\n\n{table_of(LONG)}\n")
    assert text.endswith("\nEnd.\n")
    with page.with_name("page-by-depth.csv").open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["case", "error", "a"]
    assert rows[1:] == [[f"case {n}", f"{n} %", "|a|"] for n in range(LONG)]
    assert not old.exists()
