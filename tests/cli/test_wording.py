"""Messages of the library in words of the command line."""

from __future__ import annotations

import ast
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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("solve it again with solve_orders", "solve it again with 'mitsuba-diffraction solve'"),
        (
            "use DiffractionTable.build(wavelength_range=(360, 830), second_order=true)",
            "use 'mitsuba-diffraction precompute --wavelength-range 360 830 --second-order true'",
        ),
        (
            "run the command 'tangents a.obj -o b.ply'",
            "run 'mitsuba-diffraction tangents a.obj -o b.ply'",
        ),
        ("give material:ID=FILE", "give --material ID=FILE"),
    ],
)
def test_calls_are_commands(text, expected):
    assert worded(text) == expected
    assert worded(expected) == expected


def test_parameters_that_are_flags_or_called_otherwise():
    speak_for(build_parser().parse_args(["solve", "a.csv"]).parser)
    assert worded("accept=True writes it") == "accept=True (--accept) writes it"
    assert worded("use method=integral") == "use method=integral (--solver integral)"


def test_options_of_messages_exist():
    """Calls in messages have the names of options."""
    precompute = build_parser().parse_args(["precompute", "a.npy"]).parser
    options = {word for action in precompute._actions for word in action.option_strings}
    calls = [
        call
        for file in PACKAGE.rglob("*.py")
        for call in re.findall(r"\.build\((\w+)=", file.read_text("utf-8"))
    ]
    assert calls
    assert {f"--{name.replace('_', '-')}" for name in calls if name != "{name}"} <= options


#: Files that may have options: programs of their own or others', and the line that is a command.
_HAVE_OPTIONS = (
    "osl/blender_material.py",
    "realtime/glsl/viewer.py",
    "cluster/workers.py",
    "llvm.py",
    "heights/load.py",
)


def test_only_cli_writes_commands():
    """Messages elsewhere name parameters and functions."""
    for file in PACKAGE.rglob("*.py"):
        name = file.relative_to(PACKAGE).as_posix()
        if name.startswith("cli/") or name in _HAVE_OPTIONS:
            continue
        tree = ast.parse(file.read_text("utf-8"))
        statements = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and id(node) not in statements
            ):
                command = re.search(r"(?<!\w)(--[a-z]|-D )|mitsuba-diffraction ", node.value)
                assert not command, f"{name}: {node.value}"
