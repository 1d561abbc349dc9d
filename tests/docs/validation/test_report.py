"""Pages of the validation, and the command that writes them."""

from __future__ import annotations

import re

import pytest

from docs.make.figures.pages import part
from docs.make.validation.__main__ import main
from docs.make.validation.pages.report import PAGES, page_path
from tests.support import ROOT
from tests.support.pages import markers

pytestmark = pytest.mark.thorough

DOCS = ROOT / "docs"


@pytest.fixture
def blank(tmp_path):
    """The folder of the documentation, with pages whose parts are empty."""
    (tmp_path / "validation").mkdir()
    for name in PAGES:
        text = page_path(DOCS, name).read_text(encoding="utf-8")
        page_path(tmp_path, name).write_text(
            re.sub(r"(<!-- begin (\S+) -->)(\n?).*?(<!-- end \2 -->)", r"\1\3\4", text, flags=re.S),
            encoding="utf-8",
        )
    return tmp_path


def test_the_report_is_whole(blank, capsys):
    assert main(["--quick", "-o", str(blank)]) == 0
    printed = capsys.readouterr().out
    pictures = set()
    for name in PAGES:
        page = page_path(blank, name)
        assert str(page) in printed
        text = page.read_text(encoding="utf-8")
        assert markers(text)
        for part_name in markers(text):
            assert part(text, part_name), f"{name}: nothing writes {part_name}"
        assert "nan" not in text
        assert "\n[Table of" in text or text.count("\n|") > 2  # head, rule and a row
        pictures |= set(re.findall(r"\]\([./]*(images/validation_[^)]+)\)", text))
    assert len(pictures) == 4
    for picture in pictures:
        assert (blank / picture).read_bytes().startswith(b"\x89PNG")


def test_a_page_is_written_alone(blank):
    before = {name: page_path(blank, name).read_bytes() for name in PAGES}
    assert main(["layers", "--quick", "-o", str(blank)]) == 0
    changed = [name for name in PAGES if page_path(blank, name).read_bytes() != before[name]]
    assert changed == ["layers"]


def test_a_page_that_is_missing_is_named(tmp_path, capsys):
    assert main(["conductor", "--quick", "-o", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert str(page_path(tmp_path, "conductor")) in error
    assert error.count("\n") == 1
