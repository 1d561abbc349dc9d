"""What the package says of itself: files and names in ARCHITECTURE.md and in contents exist."""

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


def test_a_class_name_has_one_meaning():
    found = Counter(
        name
        for file in PACKAGE.rglob("*.py")
        for name in re.findall(r"^class ([A-Z]\w*)", file.read_text("utf-8"), re.M)
    )
    assert [name for name, count in found.items() if count > 1] == []


INITS = {
    str(file.parent.relative_to(PACKAGE.parent)): file
    for file in sorted(PACKAGE.rglob("__init__.py"))
    if "\nContents\n" in file.read_text("utf-8")
}


def contents(file: Path) -> list[str]:
    """The names in the first column."""
    docstring = ast.get_docstring(ast.parse(file.read_text("utf-8")))
    lines = docstring.split("--------\n")[1].split("\n\n")[0].splitlines()
    first = [re.match(r"[\w, ]+?(?=  |$| `)", line)[0] for line in lines if line[0] != " "]
    return [name for names in first for name in names.split(", ")]


@pytest.mark.parametrize("name", INITS)
def test_every_name_is_a_module_or_exported(name):
    file = INITS[name]
    tree = ast.parse(file.read_text("utf-8"))
    exported = {
        value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
        for value in node.value.elts
    }
    folder = file.parent
    modules = {path.stem for path in folder.glob("*.py")} | {
        path.parent.name for path in folder.glob("*/__init__.py")
    }
    imported = {
        alias.name for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) for alias in n.names
    }
    assert exported <= modules | imported | {getattr(n, "name", None) for n in tree.body}
    named = contents(file)
    assert len(named) == len(set(named)) > 0
    assert set(named) <= modules | exported
    # a list of modules is complete; one of names is of those that others use
    if len(set(named) & modules) > len(named) / 2 and name != "mitsuba_diffraction":
        listed = set(named) | {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
        assert modules - {"__init__", "__main__"} <= listed
