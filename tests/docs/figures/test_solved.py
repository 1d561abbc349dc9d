"""The table of the shipped tables of orders."""

from __future__ import annotations

import re

from docs.make.figures import pages, solved
from tests.support import ROOT


def numbers(text: str) -> list[str]:
    """Return the numbers of the rows of a table in Markdown."""
    rows = (line for line in text.splitlines() if line.startswith("|"))
    return [number for row in rows for number in re.findall(r"\d+(?:\.\d+)?", row)]


def test_the_page_has_the_numbers_of_the_shipped_tables(monkeypatch):
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs/orders.md").read_text("utf-8")
    made = numbers(solved.text())
    assert len(made) > 20
    assert numbers(pages.part(page, "solved")) == made
