"""Pages of the validation, and the command that writes them."""

from __future__ import annotations

import re

import pytest

from docs.make.validation.__main__ import main
from docs.make.validation.pages.markdown import joined, percent, table
from docs.make.validation.pages.report import PAGES, page_path

pytestmark = pytest.mark.thorough


def test_the_report_is_whole(tmp_path, capsys):
    folder = tmp_path / "docs"
    assert main(["--quick", "-o", str(folder)]) == 0
    printed = capsys.readouterr().out
    pictures = set()
    for name in PAGES:
        page = page_path(folder, name)
        assert str(page) in printed
        text = page.read_text(encoding="utf-8")
        assert text.startswith("# ")
        assert "nan" not in text
        assert "\n[Table of" in text or text.count("\n|") > 2  # head, rule and a row
        pictures |= set(re.findall(r"\]\([./]*(images/[^)]+)\)", text))
    assert len(pictures) == 4
    for picture in pictures:
        assert (folder / picture).read_bytes().startswith(b"\x89PNG")


def test_a_page_is_written_alone(tmp_path):
    assert main(["layers", "--quick", "-o", str(tmp_path)]) == 0
    assert [path.name for path in tmp_path.rglob("*.md")] == ["layers.md"]


def test_numbers_have_the_digits_that_they_deserve():
    values = [percent(x) for x in (0.12345, 0.012345, 0.0998, 1e-6, 0.0, -0.05, float("nan"))]
    assert values == ["12 %", "1.2 %", "10 %", "< 0.01 %", "0 %", "−5 %", "–"]
    assert joined([1.0, 2.5, 3.0]) == "1, 2.5 and 3"
    assert table(["a", "b"], [["x", 1]]) == "| a | b |\n| --- | ---: |\n| x | 1 |"
