"""Page of the plugin's parameters, from the plugin's docstring.

python -m docs.make.figures.parameters -o docs/parameters.md
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError

from . import pages
from .pages import exit_code

#: Read, not imported: that would take a variant of Mitsuba.
PLUGIN = Path(__file__).resolve().parents[3] / "mitsuba_diffraction/plugin/bsdf.py"

_GROUP = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.M)
_ENTRY = re.compile(
    r"^(?P<names>[\w(), ]+) : (?P<type>[^\[\n∂]+?)(?P<d> ∂)?(?: \[(?P<default>.+)\])?$"
)
_MODEL, _EXAMPLE = "\nThe model is ", "\nXML and the same in Python:\n"


@dataclass(frozen=True)
class Parameter:
    """Entry of the page: usually one parameter, sometimes two that belong together."""

    names: tuple[str, ...]  # of the parameters; "(nested)" for an object of any name
    # type, default, text: as the docstring has them
    type: str
    default: str  # empty if there is none
    differentiable: bool  # whether all of them are
    text: str


def docstring() -> str:
    """Docstring of the plugin."""
    return ast.get_docstring(ast.parse(PLUGIN.read_text(encoding="utf-8"))) or ""


def groups(text: str) -> dict[str, list[Parameter]]:
    """Parameters that a docstring describes, by the heading above them."""
    _, *parts = _GROUP.split(text.partition(_MODEL)[0])
    return {heading: _entries(body) for heading, body in zip(parts[::2], parts[1::2], strict=True)}


def _entries(body: str) -> list[Parameter]:
    entries = []
    for entry in re.split(r"\n(?=\S)", body.strip()):
        head, _, rest = entry.partition("\n")
        match = _ENTRY.match(head)
        if match is None or not rest.strip():
            raise DiffractionError(
                f"'{PLUGIN}': expected 'name : type [default]' and text below it, got '{head}'"
            )
        entries.append(
            Parameter(
                tuple(match["names"].split(", ")),
                match["type"],
                match["default"] or "",
                match["d"] is not None,
                " ".join(rest.split()),
            )
        )
    return entries


def page(text: str) -> str:
    """Return the page in Markdown, from the plugin's docstring."""
    model, _, example = text.partition(_MODEL)[2].partition(_EXAMPLE)
    xml, _, python = textwrap.dedent(example).strip().partition("\n\n")
    sections = [
        "# Parameters of `diffraction`",
        "Made by `make parameters` of the text at the top of "
        "[bsdf.py](../mitsuba_diffraction/plugin/bsdf.py). ∂: differentiable, a parameter of "
        "`mi.traverse`. Lengths are in µm, wavelengths in nm. In an image file the top row is the "
        "largest y.",
    ]
    for heading, entries in groups(text).items():
        sections += [f"## {heading}", pages.table(_HEADER, [_row(entry) for entry in entries])]
    sections += [
        "## The model",
        _prose(f"The model is {model}"),
        "[theory.md](theory.md) has all of it, symbol by symbol.",
        "## An example",
        f"```xml\n{xml}\n```",
        f"```python\n{python}\n```",
    ]
    return "\n\n".join(sections) + "\n"


_HEADER = ("parameter", "type", "default", "meaning")


def _row(entry: Parameter) -> tuple[str, ...]:
    names = ", ".join(name[1:-1] if name.startswith("(") else f"`{name}`" for name in entry.names)
    cells = (names, entry.type + (" ∂" if entry.differentiable else ""), entry.default, entry.text)
    return tuple(cell.replace("|", r"\|") for cell in cells)


def _prose(text: str) -> str:
    """Return paragraphs on one line each, and indented text as code."""
    shown = []
    for paragraph in re.split(r"\n\n+", text.strip()):
        indented = paragraph.startswith("    ")
        shown.append(paragraph if indented else " ".join(paragraph.split()))
    return "\n\n".join(shown)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the page, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.parameters")
    parser.add_argument(
        "-o", "--output", metavar="FILE", type=Path, default=Path("docs/parameters.md"),
        help="page to write; default: docs/parameters.md",
    )  # fmt: skip
    args = parser.parse_args(argv)

    def work() -> None:
        with atomic_path(args.output) as temporary:
            temporary.write_text(page(docstring()), encoding="utf-8")

    return exit_code("parameters", work)


if __name__ == "__main__":
    sys.exit(main())
