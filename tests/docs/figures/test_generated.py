"""Generated pages and parts of pages are what the code says."""

from __future__ import annotations

import re

import pytest

from docs.make.figures import interfaces, pages, solved
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.heights.formats.catalogue import ARRAYS, OPTICAL, PROBES
from tests.support import ROOT
from tests.support.pages import PAGES


@pytest.mark.parametrize("page", interfaces.PAGES)
def test_the_page_is_what_the_code_says(page):
    remedy = "python -m docs.make.figures.interfaces -o docs"
    assert PAGES[f"docs/{page}"] == interfaces.PAGES[page](), remedy


def test_every_command_has_a_place():
    grouped = {name for names in interfaces.GROUPS.values() for name in names}
    assert grouped == set(interfaces.subparsers())


def test_the_page_has_the_tables_of_formats():
    assert pages.part(PAGES["docs/formats.md"], "formats") == interfaces.format_tables()


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

    made = numbers(solved.text())
    assert len(made) > 20
    assert numbers(pages.part(PAGES["docs/orders.md"], "solved")) == made


def test_a_part_is_replaced_and_all_else_stays():
    text = "a\n<!-- begin t -->\nold\n<!-- end t -->\nb\n"
    new = pages.replaced(text, "t", "new\n")
    assert new == "a\n<!-- begin t -->\nnew\n<!-- end t -->\nb\n"
    assert pages.part(new, "t") == "new"
    with pytest.raises(DiffractionError):
        pages.replaced(text + text, "t", "new")
