"""Options tell their defaults; earlier spellings become the current ones, which is said once."""

from __future__ import annotations

import argparse

import pytest

from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.cli.spellings import current

#: A command line, and the current word in it; none where the line is current.
LINES = {
    "spectrum --wavelength-range 400 700 a.npy": "--wavelength-range=400:700",
    "solve lamellar --wavelength-range 380,780": "--wavelength-range=380:780",
    "solve lamellar --wavelength-range=380,780": "--wavelength-range=380:780",
    "evaluate a.npy --angles -75 30": "--angles=-75:30",
    "render a.obj --look=skin": "--finish=skin",
    "tonemap a.exr --view standard": "--tonemap",
    "evaluate a.npy --windows 2": "--positions",
    "tangents a.ply --turn 90": "--rotate",
    "render a.xml --material ball=t.exr": "--assign",
    "export-viewer a.xml page.html": "-o",
    "spectrum a.npy --wavelength-range 400:700": "",
    "evaluate --angles=-75:30": "",
    # the same name elsewhere
    "precompute a.npy --windows 5": "",
    "brdf-map a.exr --material gold": "",
    "render --turn sun": "",
    "export-viewer a.xml -o page.html": "",
}


@pytest.mark.parametrize("line", LINES)
def test_an_earlier_spelling_is_the_current_one_and_is_said(line, capsys):
    words, said = current(line.split()), capsys.readouterr().err
    assert said.count("is now") == len(said.splitlines()) == bool(LINES[line])
    if LINES[line]:
        assert LINES[line] in words
    else:
        assert "=".join(words).split("=") == line.replace("=", " ").split()
    files = {word for word in line.split() if word.endswith((".npy", ".obj", ".exr", ".ply"))}
    assert files <= {*words}


def test_each_option_tells_its_default_once():
    parsers = next(a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    without = None, False, True, argparse.SUPPRESS
    told = {
        f"{name} {action.dest}": str(action.help).count("default:")
        for name, parser in parsers.items()
        for action in parser._actions
        if action.option_strings and not any(action.default is each for each in without)
        and action.default != []
    }  # fmt: skip
    assert {option for option, count in told.items() if count != 1} == set()
