"""Docstrings say what they describe: none of public code begins with a pronoun or a preposition.

`python -m tests.support.docstrings` prints, for each room, how many docstrings begin vaguely in
public code and in all code, and how many there are.
"""

from __future__ import annotations

import pytest

from tests.support.docstrings import Docstring, docstrings

# Part of all docstrings, private code included, that may begin vaguely.
ALLOWED = 0.02


@pytest.fixture(scope="module")
def texts() -> list[Docstring]:
    """All docstrings of the package."""
    return list(docstrings())


def listed(texts: list[Docstring]) -> str:
    """Return one line for each docstring."""
    return "\n".join(map(str, texts))


def test_no_docstring_of_public_code_begins_vaguely(texts):
    vague = [text for text in texts if text.public and text.vague]
    assert not vague, f"{len(vague)} of public code:\n{listed(vague)}"


def test_few_docstrings_of_all_code_begin_vaguely(texts):
    vague = [text for text in texts if text.vague]
    assert len(vague) <= ALLOWED * len(texts), f"{len(vague)} of {len(texts)}:\n{listed(vague)}"
