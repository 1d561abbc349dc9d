"""The table of the shipped tables of orders."""

from __future__ import annotations

from docs.make.figures import pages, solved
from tests.support import ROOT


def test_the_page_has_the_headers_of_the_shipped_tables(monkeypatch):
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs/orders.md").read_text("utf-8")
    assert pages.part(page, "solved").strip() == solved.text()
