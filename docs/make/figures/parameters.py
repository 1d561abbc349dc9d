"""The reference of the plugins' parameters, made of the plugins' own docstrings.

`python -m docs.make.figures.interfaces` writes it.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import mitsuba_diffraction
from mitsuba_diffraction.errors import DiffractionError

from . import pages

_FOLDER = Path(mitsuba_diffraction.__file__).parent / "plugin"
#: Modules of the plugins; read, not imported, which would need a variant of Mitsuba.
PLUGINS = {
    "diffraction": _FOLDER / "diffraction.py",
    "diffraction_dielectric": _FOLDER / "diffraction_dielectric.py",
    "diffraction_orders": _FOLDER.parent / "orders/bsdf/diffraction_orders.py",
    "diffraction_mix": _FOLDER / "diffraction_mix.py",
}

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


def docstring(plugin: str) -> str:
    """Return the docstring of a plugin."""
    return ast.get_docstring(ast.parse(PLUGINS[plugin].read_text(encoding="utf-8"))) or ""


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
                f"expected 'name : type [default]' and text below it, got '{head}'"
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


def parts() -> dict[str, str]:
    """Return the reference of each plugin in Markdown."""
    found = {}
    for plugin in PLUGINS:
        text = docstring(plugin)
        introduction = _GROUP.split(text)[0].partition("\n\n")[2]
        *tables, example = _parts(text)
        # the first plugin's introduction is the page's, and others' examples have its names
        first = plugin == "diffraction"
        shown = [*tables, example] if first else [_prose(introduction), *tables]
        found[plugin] = "\n\n".join(shown)
    return found


def _parts(text: str) -> Iterator[str]:
    """Tables of parameters, model and example of a plugin's docstring."""
    for heading, entries in groups(text).items():
        yield f"## {heading}"
        yield pages.table(_HEADER, [_row(entry) for entry in entries])
    model, _, example = text.partition(_MODEL)[2].partition(_EXAMPLE)
    xml, _, python = textwrap.dedent(example).strip().partition("\n\n")
    yield "## The model"
    yield _prose(f"The model is {model}")
    yield f"```xml\n{xml}\n```"
    yield f"```python\n{python}\n```"


_HEADER = ("parameter", "type; default", "meaning")


def _row(entry: Parameter) -> tuple[str, ...]:
    names = ", ".join(name[1:-1] if name.startswith("(") else f"`{name}`" for name in entry.names)
    kind = entry.type + (" ∂" if entry.differentiable else "")
    cells = (names, f"{kind}; {entry.default}" if entry.default else kind, entry.text)
    return tuple(cell.replace("|", r"\|") for cell in cells)


def _prose(text: str) -> str:
    """Return paragraphs on one line each, and indented text as code."""
    shown = []
    for paragraph in re.split(r"\n\n+", text.strip()):
        indented = paragraph.startswith("    ")
        shown.append(paragraph if indented else " ".join(paragraph.split()))
    return "\n\n".join(shown)
