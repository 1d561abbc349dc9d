"""ARCHITECTURE.md: every file and every name in it exists."""

from __future__ import annotations

import ast
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
    """Functions and classes of the package, and methods and attributes after their class."""
    found = set()
    for file in PACKAGE.rglob("*.py"):
        for node in ast.parse(file.read_text("utf-8")).body:
            found |= defined(node)
    return found


def defined(node: ast.stmt) -> set[str]:
    """Names of a statement of a module."""
    if isinstance(node, ast.FunctionDef):
        return {node.name}
    if not isinstance(node, ast.ClassDef):
        return set()
    methods = {f"{node.name}.{n.name}" for n in node.body if isinstance(n, ast.FunctionDef)}
    return {node.name, *methods}


@pytest.mark.parametrize("step", STEPS, ids=range(len(STEPS)))
def test_a_step_is_in_its_file(step):
    file, name, *others = re.findall(r"`([^`]+)`", step)
    found = set()
    for node in ast.parse((PACKAGE / file).read_text("utf-8")).body:
        found |= defined(node)
    assert name in found
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
