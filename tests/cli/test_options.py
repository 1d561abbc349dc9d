"""Earlier spellings of options: the current one stands in their place, and it is said once."""

from __future__ import annotations

import pytest

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
