"""Options declared as rows, refusals of those that do not go together, and earlier spellings."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from mitsuba_diffraction.cli.main import Parser
from mitsuba_diffraction.cli.options import (
    add_options,
    given,
    option_of,
    refuse,
)
from mitsuba_diffraction.cli.spellings import current
from mitsuba_diffraction.cli.values import limits, whole_number


@pytest.fixture
def parser() -> argparse.ArgumentParser:
    """A parser with an option of each kind."""
    parser = Parser(prog="test")
    add_options(
        parser,
        ("FILE ...", "what is read", Path, None, {"dest": "files"}),
        ("-s --spp N", "samples", whole_number(1), 64),
        ("--range FIRST:LAST", "nm; default: all", limits),
        ("--kind", "which", ("a", "b"), "a"),
        ("--thin", "a sheet", bool),
        ("--layer M:T", "film; may be given several times", [str], None, {"dest": "layers"}),
        ("--angle-step DEG", "", float, 0.1),
    )
    parser.set_defaults(parser=parser)
    return parser


def test_rows_say_type_number_and_default_of_values(parser):
    args = parser.parse_args(["a", "b"])
    assert args.files == [Path("a"), Path("b")]
    assert (args.spp, args.range, args.kind, args.thin, args.layers) == (64, None, "a", False, [])
    args = parser.parse_args(
        ["a", "-s2", "--range", "1:2", "--kind=b", "--thin", "--layer=x", "--layer=y"]
    )
    assert (args.spp, args.range, args.kind) == (2, (1.0, 2.0), "b")
    assert (args.thin, args.layers) == (True, ["x", "y"])


def test_defaults_are_told_once(parser):
    told = {action.dest: action.help for action in parser._actions}
    assert told["spp"] == "samples; default: 64"
    assert told["range"] == "nm; default: all"
    assert told["kind"] == "which; default: a"
    assert told["angle_step"] == "default: 0.1"
    assert told["thin"] == "a sheet"


def test_options_are_refused_by_their_own_names(parser, capsys):
    args = parser.parse_args(["a", "--layer", "x", "--range", "0:0", "--spp", "64"])
    names = ("thin", "layers", "range")
    assert given(args, (*names, "missing")) == {"layers": ["x"], "range": (0.0, 0.0)}
    assert given(args, ["spp", "kind"]) == {"spp": 64}  # a default, but asked for
    assert option_of(args, "spp") == "--spp"
    refuse(args, ["thin"], ": not here")
    with pytest.raises(SystemExit):
        refuse(args, names, ": not here")
    assert "error: argument --layer: not here" in capsys.readouterr().err


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
