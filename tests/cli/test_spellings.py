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


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("render a.obj --look=skin", "--finish=skin"),
        ("tonemap a.exr --view standard", "--tonemap"),
        ("evaluate a.npy --windows 2", "--positions"),
        ("tangents a.ply --turn 90", "--rotate"),
        ("render a.xml --material ball=t.exr", "--assign"),
        ("export-viewer a.xml page.html", "-o"),
    ],
)
def test_an_old_name_is_the_current_one_where_it_was_renamed(old, new, capsys):
    assert new in current(old.split())
    assert capsys.readouterr().err.count("is now") == 1


@pytest.mark.parametrize(
    "line",
    [
        "precompute a.npy --windows 5",
        "brdf-map a.exr --material gold",
        "render --turn sun",
        "export-viewer a.xml -o page.html",
    ],
)
def test_the_same_name_elsewhere_is_kept(line, capsys):
    assert current(line.split()) == line.split()
    assert capsys.readouterr().err == ""
