"""The page and the command that writes it."""

from __future__ import annotations

import re

import pytest

from docs.make.validation import models
from docs.make.validation.__main__ import main
from docs.make.validation.markdown import joined, percent, table


@pytest.mark.usefixtures("coarse")  # of energy it only asks that figures are there
def test_the_report_is_whole(tmp_path, capsys):
    assert main(["report", "--quick", "-o", str(tmp_path / "docs")]) == 0
    page = tmp_path / "docs" / "validation.md"
    assert str(page) in capsys.readouterr().out
    text = page.read_text(encoding="utf-8")
    for heading in (
        "Kirchhoff, small slope, and the blend", "Two dimensions, and any plane of incidence",
        "What the second order would bring", "Slope decides", "Edges", "Under a coat",
        "A gentle grating of a perfect conductor",
        "Polarisation of a perfect conductor", "The rigorous solutions", "Closed forms",
        "Random surfaces",
    ):  # fmt: skip
        assert f"\n## {heading}\n" in text
    assert "nan" not in text
    pictures = re.findall(r"\]\((images/[^)]+)\)", text)
    assert len(pictures) == 4
    for picture in pictures:
        assert (page.parent / picture).read_bytes().startswith(b"\x89PNG")
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) > 100
    assert sorted(path.name for path in page.parent.iterdir()) == ["images", "validation.md"]


def test_groups_prints_what_the_page_compares_the_models_by(capsys, monkeypatch):
    monkeypatch.setattr(models, "MATERIALS", ("aluminium",))
    assert main(["groups"]) == 0
    printed = capsys.readouterr().out
    assert "| aluminium, sinusoidal | 0 to 0.03 | " in printed
    assert "| aluminium, crossed grating | 0.1 | 550 | " in printed


def test_a_folder_that_cannot_be_written_is_an_error_in_one_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["report", "--quick", "-o", str(tmp_path / "file" / "docs")]) == 1
    error = capsys.readouterr().err
    assert "error: cannot write" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("arguments", [[], ["solve", "gold"], ["solve", "keratin", "-j", "0"]])
def test_wrong_usage_is_2(arguments, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    assert "usage:" in capsys.readouterr().err


def test_numbers_have_the_digits_that_they_deserve():
    values = [percent(x) for x in (0.12345, 0.012345, 0.0998, 1e-6, 0.0, -0.05, float("nan"))]
    assert values == ["12 %", "1.2 %", "10 %", "< 0.01 %", "0 %", "−5 %", "–"]
    assert joined([1.0, 2.5, 3.0]) == "1, 2.5 and 3"
    assert table(["a", "b"], [["x", 1]]) == "| a | b |\n| --- | ---: |\n| x | 1 |"
