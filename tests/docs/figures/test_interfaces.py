"""The pages of commands and of Python names are those of the code."""

from __future__ import annotations

import pytest

from docs.make.figures.interfaces import GROUPS, PAGES, subparsers
from tests.support import ROOT

REMEDY = "python -m docs.make.figures.interfaces -o docs"


@pytest.mark.parametrize("page", PAGES)
def test_the_page_is_what_the_code_says(page):
    assert (ROOT / "docs" / page).read_text(encoding="utf-8") == PAGES[page](), REMEDY


def test_every_command_has_a_place():
    assert {name for names in GROUPS.values() for name in names} == set(subparsers())
