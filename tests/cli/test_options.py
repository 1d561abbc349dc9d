"""Options declared as rows, and refusals of those that do not go together."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from mitsuba_diffraction.cli.options import add_options, given, option_of, refuse, whole_number


@pytest.fixture
def parser() -> argparse.ArgumentParser:
    """A parser with an option of each kind."""
    parser = argparse.ArgumentParser(prog="test")
    add_options(
        parser,
        ("FILE ...", "what is read", Path, None, {"dest": "files"}),
        ("-s --spp N", "samples", whole_number(1), 64),
        ("--range LOW HIGH", "nm; default: all", float),
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
        ["a", "-s2", "--range", "1", "2", "--kind=b", "--thin", "--layer=x", "--layer=y"]
    )
    assert (args.spp, args.range, args.kind) == (2, [1.0, 2.0], "b")
    assert (args.thin, args.layers) == (True, ["x", "y"])


def test_defaults_are_told_once(parser):
    told = {action.dest: action.help for action in parser._actions}
    assert told["spp"] == "samples; default: 64"
    assert told["range"] == "nm; default: all"
    assert told["kind"] == "which; default: a"
    assert told["angle_step"] == "default: 0.1"
    assert told["thin"] == "a sheet"


def test_options_are_refused_by_their_own_names(parser, capsys):
    args = parser.parse_args(["a", "--layer", "x", "--range", "0", "0"])
    names = ("thin", "layers", "range")
    assert given(args, (*names, "missing")) == {"layers": ["x"], "range": [0.0, 0.0]}
    assert option_of(args, "spp") == "--spp"
    refuse(args, ["thin"], ": not here")
    with pytest.raises(SystemExit):
        refuse(args, names, ": not here")
    assert "error: argument --layer: not here" in capsys.readouterr().err
