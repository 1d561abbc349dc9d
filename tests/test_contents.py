"""The tables of contents in `__init__` files name what there is."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import mitsuba_diffraction

PACKAGE = Path(mitsuba_diffraction.__file__).parent
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


def test_most_folders_have_one():
    folders = {file.parent for file in PACKAGE.rglob("__init__.py")}
    assert len(INITS) >= len(folders) - 1  # gratings says it in sentences
