"""Imports go one way: down the layers, and never in a circle."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import grimp
import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

from tests.support import ROOT

PACKAGE = "mitsuba_diffraction"
TESTS = sorted((ROOT / "tests").rglob("*.py"))


@pytest.fixture(scope="module")
def imports() -> dict[str, set[str]]:
    """What each module imports, also within functions and for type checking."""
    graph = grimp.build_graph(PACKAGE, cache_dir=None)
    return {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}


def circles(imports: dict[str, set[str]]) -> list[set[str]]:
    """Strongly connected components of more than one module (Tarjan 1972)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []

    def visit(name: str) -> None:
        order[name] = low[name] = len(order)
        stack.append(name)
        for other in sorted(imports[name]):
            if other not in order:
                visit(other)
            if other in stack:
                low[name] = min(low[name], low[other])
        if low[name] == order[name]:
            place = stack.index(name)
            found.append(set(stack[place:]))
            del stack[place:]

    for name in sorted(imports):
        if name not in order:
            visit(name)
    return [component for component in found if len(component) > 1]


def test_imports_go_down_the_layers(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == EXIT_STATUS_SUCCESS, capsys.readouterr().out


def test_no_modules_import_each_other_in_a_circle(imports):
    assert circles(imports) == []


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == [{"b", "c"}]


def imported(file: Path) -> Iterator[str]:
    """Modules of the tests that a file imports, by its lines: syntax trees take a second."""
    for module, names in _IMPORT.findall(file.read_text("utf-8")):
        if module == "tests":
            yield from (f"tests.{name}" for name in re.findall(r"\w+", names))
        else:
            yield module


_IMPORT = re.compile(r"^\s*(?:from|import) (tests\b[\w.]*)(?: import (.+))?", re.M)


def test_tests_import_helpers_and_never_one_another():
    wrong = [
        f"{file.relative_to(ROOT)} imports {name}"
        for file in TESTS
        for name in imported(file)
        # the fuzz is a program of several modules
        if name.split(".")[1] != "support" and not ("fuzz" in file.parts and "fuzz" in name)
    ]
    assert not wrong


def test_no_test_file_lies_where_pytest_does_not_look(pytestconfig):
    patterns = pytestconfig.getini("norecursedirs")
    for folder in {part for file in TESTS for part in file.relative_to(ROOT).parts[:-1]}:
        assert not any(fnmatch(folder, pattern) for pattern in patterns), folder
