"""ARCHITECTURE.md: every file and every name in it exists."""

from __future__ import annotations

import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

import mitsuba_diffraction
from tests.support import ROOT

PAGE = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
PACKAGE = Path(mitsuba_diffraction.__file__).parent
_, _, AFTER = PAGE.partition("## One load, one eval, one change of a parameter")
STEPS = re.findall(r"^\d+\. .*", AFTER.partition("\n## ")[0], re.M)


@cache
def names() -> set[str]:
    """`defined` of all files of the package."""
    return set().union(*map(defined, PACKAGE.rglob("*.py")))


def defined(file: Path) -> set[str]:
    """Functions and classes of a file, and methods after their class."""
    found, parent = set(), ""
    for indent, kind, name in _DEFINED.findall(file.read_text("utf-8")):
        if not indent:
            parent = f"{name}." if kind == "class" else ""
            found.add(name)
        elif parent and kind == "def":
            found.add(parent + name)
    return found


_DEFINED = re.compile(r"^(    )?(class|def) (\w+)", re.M)


@pytest.mark.parametrize("step", STEPS, ids=range(len(STEPS)))
def test_a_step_is_in_its_file(step):
    file, name, *others = re.findall(r"`([^`]+)`", step)
    assert name in defined(PACKAGE / file)
    for other in others:
        if other.endswith(".py"):
            assert (PACKAGE / other).is_file()
        elif other not in ("parameters", "dr.freeze"):  # an attribute, and Dr.Jit's
            assert other in names()


def test_each_way_has_ten_steps():
    assert [step.split(".")[0] for step in STEPS] == 3 * [str(n) for n in range(1, 11)]


def test_files_exist():
    folders = (ROOT, PACKAGE.parent, PACKAGE)
    for name in re.findall(r"`([\w/.]+\.(?:py|md))`", PAGE):
        assert any((folder / name).exists() for folder in folders), name


def test_a_class_name_has_one_meaning():
    found = Counter(
        name
        for file in PACKAGE.rglob("*.py")
        for name in re.findall(r"^class ([A-Z]\w*)", file.read_text("utf-8"), re.M)
    )
    assert [name for name, count in found.items() if count > 1] == []
