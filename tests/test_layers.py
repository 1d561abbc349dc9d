"""Imports go one way, and programs, rooms and tests import what rooms export."""

from __future__ import annotations

import ast
import contextlib
import re
from collections.abc import Iterator
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

import mitsuba_diffraction
from tests.support import ROOT

PACKAGE = "mitsuba_diffraction"
INSTALLED = Path(mitsuba_diffraction.__file__).parent
TESTS = sorted((ROOT / "tests").rglob("*.py"))


def test_imports_keep_the_contracts(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == EXIT_STATUS_SUCCESS, capsys.readouterr().out


def imported(file: Path) -> Iterator[str]:
    """Modules of the tests that a file imports, by its lines: syntax trees take a second."""
    for module, names in _IMPORT.findall(file.read_text("utf-8")):
        if module == "tests":
            yield from (f"tests.{name}" for name in re.findall(r"\w+", names))
        else:
            yield module


_IMPORT = re.compile(r"^\s*(?:from|import) (tests\b[\w.]*)(?: import (.+))?", re.M)


def room_of(test: Path) -> str:
    """First folder of a test's path; helpers that a room's tests share may lie there."""
    return test.relative_to(ROOT / "tests").parts[0]


def test_tests_import_helpers_and_never_one_another():
    wrong = [
        f"{file.relative_to(ROOT)} imports {name}"
        for file in TESTS
        for name in imported(file)
        if name.split(".")[1] not in ("support", room_of(file))
        or re.search(r"\.(test_\w+|conftest)$", name)
    ]
    assert not wrong


@cache
def initial(room: Path) -> str:
    """Text of a room's `__init__`."""
    return (room / "__init__.py").read_text("utf-8")


@cache
def exports(room: Path) -> set[str]:
    """Names in `__all__` of a room's `__init__`; of the package, also its modules."""
    text = initial(room)
    listed = re.search(r"^__all__ = (\[.*?\])", text, re.M | re.S)
    names = set(ast.literal_eval(listed[1])) if listed else set()
    return names | ({file.stem for file in room.glob("*.py")} if room.name == PACKAGE else set())


def hidden_by(name: str) -> Path | None:
    """The room that does not export a dotted name, if one does not.

    Sub-rooms are public; modules that a room exports are, with their names.
    """
    room, exported = INSTALLED, ""
    for part in name.split(".")[1:]:
        if re.match("_(?!_|replace$)", part):  # `_replace` is public
            return room
        if not exported and (room / part / "__init__.py").is_file():
            room /= part
        elif exported:
            # a function hides the module of the same name
            names = rf"(\([^)]*|.*)\b{exported}\b"
            if re.search(rf"^from \.{exported} import {names}", initial(room), re.M):
                return room
        elif part in exports(room) or part.startswith("__"):
            exported = part
        else:
            return room
    return None


def names_of_the_package(source: str) -> Iterator[tuple[int, str]]:
    """Lines and dotted names of a program's imports, and of attributes of imported modules.

    Names and programs in its strings count, too.
    """
    bound: dict[str, str] = {}
    nodes = list(ast.walk(ast.parse(source)))
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            start = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            for alias in node.names:
                name = start + alias.name
                if name.split(".")[0] == PACKAGE:
                    bound[alias.asname or alias.name] = name
                    yield node.lineno, name
    for node in nodes:
        if isinstance(node, ast.Attribute) and (start := bound.get(ast.unparse(node.value))):
            yield node.lineno, f"{start}.{node.attr}"
        if isinstance(node, ast.Constant) and PACKAGE in (text := str(node.value)):
            if re.fullmatch(rf"{PACKAGE}(\.\w+)+", text):
                yield node.lineno, text
            elif "import " in text:
                with contextlib.suppress(SyntaxError):
                    yield from names_of_the_package(text)


def test_programs_use_what_rooms_export():
    wrong = [
        f"{file.relative_to(ROOT)}:{line}: {name} is not in __all__ of "
        f"{room.relative_to(INSTALLED.parent)}: use a name that is, move it to the programs, "
        "or export it"
        for folder in ("docs/make", "scenes/make")
        for file in sorted((ROOT / folder).rglob("*.py"))
        for line, name in names_of_the_package(file.read_text("utf-8"))
        if (room := hidden_by(name)) is not None
    ]
    assert not wrong, "\n".join(wrong)


def test_rooms_use_what_other_rooms_export():
    wrong = []
    for file in sorted(INSTALLED.rglob("*.py")):
        place = file.relative_to(INSTALLED.parent).with_suffix("").parts[:-1]
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not node.level:
                continue
            start = ".".join([*place[: len(place) + 1 - node.level], node.module or ""]).rstrip(".")
            names = [f"{start}.{alias.name}" for alias in node.names]
            room = INSTALLED / f"{start}.".split(".")[1]
            if room.is_dir() and not file.is_relative_to(room):
                wrong += [f"{file}:{node.lineno}: {name}" for name in names if hidden_by(name)]
    assert not wrong, "not in __all__ of their rooms:\n" + "\n".join(wrong)


#: What tests use of inner modules of other rooms.
INNER = {
    # formulas as text: a shader holds them between others, of one surface
    "support/languages.py": {"osl.formulas.patch_formulas", "realtime.glsl.formulas.formulas"},
    # data of a table without its file, whose size and checksum would be refused first
    "fuzz/damage.py": {
        "tables.document.parse_document", "tables.document.shape_of",
        "tables.document.with_coefficients",
    },
    # work that users cannot make less
    "support/coarse.py": {
        "realtime.glsl.bounces._POINTS", "realtime.glsl.surroundings._CELLS",
        "realtime.web.export.OCTAVES",
    },
}  # fmt: skip


def test_tests_use_what_other_rooms_export():
    """Tests of a room may use all of its own modules; move a test there, or export the name."""
    rooms = {folder.parent.name for folder in INSTALLED.glob("*/__init__.py")}
    found: dict[str, set[str]] = {}
    for file in TESTS:
        for _, name in names_of_the_package(file.read_text("utf-8")):
            inner = name.removeprefix(f"{PACKAGE}.")
            room = inner.partition(".")[0]
            if room in rooms - {room_of(file)} and hidden_by(name) and file != Path(__file__):
                found.setdefault(file.relative_to(ROOT / "tests").as_posix(), set()).add(inner)
    assert found == INNER


def test_no_test_file_lies_where_pytest_does_not_look(pytestconfig):
    patterns = pytestconfig.getini("norecursedirs")
    for folder in {part for file in TESTS for part in file.relative_to(ROOT).parts[:-1]}:
        assert not any(fnmatch(folder, pattern) for pattern in patterns), folder
