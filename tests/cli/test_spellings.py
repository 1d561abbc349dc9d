"""Spellings of an earlier version are turned into current ones, with a line each."""

from __future__ import annotations

import pytest

from mitsuba_diffraction.cli.spellings import current


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("spectrum --wavelength-range 400 700 a.npy", "--wavelength-range=400:700"),
        ("solve lamellar --wavelength-range 380,780", "--wavelength-range=380:780"),
        ("solve lamellar --wavelength-range=380,780", "--wavelength-range=380:780"),
        ("evaluate a.npy --angles -75 30", "--angles=-75:30"),
    ],
)
def test_an_old_range_is_the_current_one_and_is_said(old, new, capsys):
    words = current(old.split())
    assert new in words
    assert [word for word in words if not word.startswith("--")] == [
        word for word in old.split() if not word.startswith("--") and word[-1].isalpha()
    ]
    assert capsys.readouterr().err.count(new.replace("=", " ")) == 1


@pytest.mark.parametrize(
    "line", ["spectrum a.npy --wavelength-range 400:700", "evaluate --angles=-75:30", "info x"]
)
def test_a_current_command_line_is_kept_without_a_word(line, capsys):
    words = current(line.split())
    assert [part for word in words for part in word.split("=")] == line.replace("=", " ").split()
    assert capsys.readouterr().err == ""
