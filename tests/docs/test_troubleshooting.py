"""Messages that the page of troubleshooting quotes are messages of the package."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mitsuba_diffraction
from tests.support.pages import PAGES

TEXT = PAGES["docs/troubleshooting.md"]
# Mitsuba's own message
FOREIGN = {'Plugin "diffraction" not found'}


@pytest.fixture(scope="module")
def source() -> str:
    """Code of the package, with literals that continue on the next line joined."""
    files = sorted(Path(mitsuba_diffraction.__file__).parent.rglob("*.py"))
    code = "".join(path.read_text(encoding="utf-8") for path in files)
    return re.sub(r"[\"']\n\s*f?[\"']", "", code)


def test_every_quoted_message_exists(source):
    section = TEXT.split("## Messages")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")][1:]
    quoted = [part for row in rows for part in re.findall(r"`([^`]+)`", row)]
    own = [text for text in quoted if text not in FOREIGN]
    fragments = [piece.strip() for text in own for piece in text.split("…")]
    assert len(fragments) > 15
    assert [piece for piece in fragments if piece and piece not in source] == []
