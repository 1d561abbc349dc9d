"""Docstrings of a package, read from its syntax trees."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import mitsuba_diffraction

PACKAGE = Path(mitsuba_diffraction.__file__).parent

# A docstring that begins with one of these words has no subject of its own.
VAGUE = {"What", "Of", "Those", "That", "As", "By", "Its", "It", "One", "Such"}

Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Docstring:
    """Docstring of a module, class or function: file, line, qualified name and text."""

    path: Path
    line: int
    name: str
    text: str

    @property
    def room(self) -> str:
        """Folder, or file without suffix, directly beneath the package."""
        return self.path.relative_to(PACKAGE).parts[0].removesuffix(".py")

    @property
    def public(self) -> bool:
        """Whether no part of the file's path or of the name has a leading underscore."""
        parts = [*self.path.relative_to(PACKAGE).with_suffix("").parts, *self.name.split(".")]
        return not any(part.startswith("_") and not part.endswith("__") for part in parts)

    @property
    def vague(self) -> bool:
        """Whether the text begins with a word of `VAGUE`."""
        word = re.match(r"\w+", self.text)
        return word is not None and word[0] in VAGUE

    def __str__(self) -> str:
        first = self.text.splitlines()[0]
        return f"{self.path.relative_to(PACKAGE.parent)}:{self.line} {self.name}: {first}"


def docstrings(root: Path = PACKAGE) -> Iterator[Docstring]:
    """Yield each docstring of the modules beneath `root`."""
    for path in sorted(root.rglob("*.py")):
        yield from _beneath(ast.parse(path.read_text(encoding="utf-8")), path, "")


def _beneath(node: ast.AST, path: Path, scope: str) -> Iterator[Docstring]:
    """Yield the docstrings of `node`, named `scope`, and of all that it defines."""
    if isinstance(node, Documented) and (text := ast.get_docstring(node)):
        yield Docstring(path, node.body[0].lineno, scope, text)
    for child in ast.iter_child_nodes(node):
        name = getattr(child, "name", None) if isinstance(child, Documented) else None
        yield from _beneath(child, path, ".".join(filter(None, (scope, name))))


if __name__ == "__main__":
    # figures of each room: vague and public, vague, all
    texts = list(docstrings())
    for room in sorted({text.room for text in texts}):
        here = [text for text in texts if text.room == room]
        vague = [text for text in here if text.vague]
        print(f"{room:<14}{sum(text.public for text in vague):>4}{len(vague):>5}{len(here):>6}")
