"""Pages of the site: where their links lead, and how formulas are typeset."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.make.site.links import linked_files, rewritten
from tests.support import ROOT


@pytest.mark.parametrize(
    ("source", "link", "expected"),
    [
        ("README.md", "docs/own-scene.md#recipes", "own-scene.md#recipes"),
        ("docs/own-scene.md", "../README.md", "index.md"),
        ("docs/own-scene.md", "../notebooks/first_render.ipynb", "notebooks/first_render.ipynb"),
        ("docs/validation/layers.md", "../theory.md#films", "../theory.md#films"),
        ("docs/validation/layers.md", "../images/a.png", "../images/a.png"),
        ("ARCHITECTURE.md", "docs/extending.md", "extending.md"),
        ("docs/theory.md", "https://example.org/a.md", "https://example.org/a.md"),
        ("docs/theory.md", "#films", "#films"),
    ],
)
def test_links_lead_to_the_same_file_in_the_site(source, link, expected):
    assert rewritten(f"see [it]({link}).", source) == f"see [it]({expected})."


def test_linked_files_are_outside_of_the_documents_and_exist():
    files = list(linked_files(ROOT))
    assert Path("LICENSE") in files
    assert all((ROOT / path).is_file() and path.parts[0] != "docs" for path in files)
