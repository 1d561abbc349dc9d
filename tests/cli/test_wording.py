"""Messages of the library in words of the command line."""

from __future__ import annotations

import re

import pytest

from mitsuba_diffraction.cli.main import build_parser
from mitsuba_diffraction.cli.wording import speak_for, worded
from tests.support.docstrings import PACKAGE

LINE = "a: use level=plane, or crop=2.5: pixels; build it again with DiffractionTable.build"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["precompute", "a.npy"], "use level=plane (--level plane), or crop=2.5 (--crop 2.5): "),
        (["render", "a.xml"], "use level=plane (-D level=plane), or crop=2.5 (-D crop=2.5): "),
        (["tonemap", "a.exr"], "use level=plane, or crop=2.5: "),
    ],
)
def test_parameters_get_the_option_of_the_command(words, expected):
    speak_for(build_parser().parse_args(words).parser)
    assert expected in worded(LINE)
    assert worded(LINE).endswith("again with 'mitsuba-diffraction precompute'")
    assert worded(worded(LINE)) == worded(LINE)


@pytest.mark.parametrize("room", ["heights", "tables/build"])
def test_heights_and_tables_know_no_options(room):
    """Only `cli` writes commands; recipes of solved orders are the exception."""
    for file in PACKAGE.joinpath(room).rglob("*.py"):
        if file.name not in ("recipes.py", "load.py"):
            assert not re.search(r"[( ]--[a-z]|mitsuba-diffraction ", file.read_text("utf-8")), file
