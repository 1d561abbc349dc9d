"""docs/formats.md has the tables of `info --formats`, whose formats are those of the library."""

from __future__ import annotations

import pytest

from docs.make.figures import formats, pages
from mitsuba_diffraction.heights.formats.catalogue import ARRAYS, OPTICAL, PROBES
from tests.support import ROOT


def test_the_page_has_the_tables():
    page = (ROOT / "docs/formats.md").read_text(encoding="utf-8")
    assert pages.part(page, "formats") == formats.tables()


def test_listed_suffixes_are_of_formats_that_the_library_reads():
    library = pytest.importorskip("SurfaceTopography.IO", reason="needs the extra afm")
    known = {suffix for reader in library.readers for suffix in reader.file_extensions()}
    listed = {suffix[1:] for entry in (*PROBES, *OPTICAL, *ARRAYS) for suffix in entry.suffixes}
    assert listed - known <= {"di"}
    # those left out are texts and tables of profiles, terrain, and what our own readers read
    own = {"txt", "asc", "xyz", "hfm", "csv", "npy", "xlsx", "zip", "hgt"}
    numbered = {"002", "003", "004", "005", "apx"}
    assert known - listed <= own | numbered
