"""Tables that the code writes: docs/commands.md, python.md, parameters.md and formats.md.

The parser names the commands, `md` its functions, the plugins' docstrings the parameters
(`parameters`), and `info --formats` the formats.

python -m docs.make.figures.interfaces -o docs
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from types import ModuleType

import mitsuba_diffraction as md
from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.heights import LoadOptions
from mitsuba_diffraction.heights.formats.catalogue import sections
from mitsuba_diffraction.settings import parameters_of

from . import pages, parameters
from .pages import option, program

#: Commands by what they are for: the name of the page's part.
GROUPS = {
    "measure": ("info", "spectrum", "brdf-map", "survey", "scatter", "evaluate"),
    "render": ("render", "tonemap", "presets", "tangents", "hologram", "plan"),
    "tables": ("precompute", "solve", "orders"),
    "programs": ("view", "export-viewer", "export-shader", "export-osl", "export-bsdf"),
    "accuracy": ("tradeoff", "compare", "sweep"),
}  # fmt: skip


def commands() -> dict[str, str]:
    """Return the tables of all commands, and of the options for reading heights."""
    parsers, parts = subparsers(), {}
    for group, names in GROUPS.items():
        rows = [
            (
                f"`{name}`",
                _arguments(parsers[name][0]),
                parsers[name][1][:1].upper() + parsers[name][1][1:],
            )
            for name in names
        ]
        parts[group] = pages.table(("command", "arguments", "what it does"), rows)
    rows = [
        (
            f"`--{name.replace('_', '-')} {each.metavar}`",
            each.help.replace("|", r"\|").replace("%%", "%"),
        )
        for name, each in parameters_of(LoadOptions).items()
    ]
    return parts | {"heights": pages.table(("option", "meaning"), rows)}


def subparsers() -> dict[str, tuple[argparse.ArgumentParser, str]]:
    """Return the parser and the help of each command, by name."""
    (action,) = (
        a for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction)
    )  # fmt: skip
    helps = {c.dest: c.help or "" for c in action._get_subactions()}  # noqa: SLF001
    return {name: (parser, helps[name]) for name, parser in action.choices.items()}


def _arguments(parser: argparse.ArgumentParser) -> str:
    """Return the arguments without an option, and the output's option."""
    shown = []
    for action in parser._actions:
        if not action.option_strings:
            name = str(action.metavar or action.dest).upper()
            many = {"+": f"{name} …", "*": f"[{name} …]", "?": f"[{name}]"}
            shown.append(many.get(str(action.nargs), name))
        elif "-o" in action.option_strings:
            shown.append(f"-o {action.metavar or ''}".strip())
    return f"`{' '.join(shown)}`" if shown else ""


def names() -> dict[str, str]:
    """Return the table of the public names of the package."""
    entries = _contents(md.__doc__ or "")
    rows = [(f"`md.{name}`", entries[name], _members(getattr(md, name))) for name in entries]
    return {"names": pages.table(("name", "what it is", "names in it"), rows)}


def _contents(docstring: str) -> dict[str, str]:
    """Return the entries of a table of contents, by name."""
    lines = docstring.split("--------\n")[1].split("\n\n")[0]
    found = re.findall(r"^(\w+) {2,}(.*(?:\n {4,}.*)*)", lines, re.M)
    return {name: " ".join(text.split()) for name, text in found}


def _members(value: object) -> str:
    """Return the functions and classes of a module; of other values nothing."""
    if not isinstance(value, ModuleType):
        return ""
    names = [n for n in getattr(value, "__all__", []) if not n.startswith("_")]
    shown = [
        f"`{name}`" for name in names if not isinstance(getattr(value, name, value), ModuleType)
    ]
    more = f" and {len(shown) - _MOST} more" if len(shown) > _MOST else ""
    return ", ".join(shown[:_MOST]) + more


# Names of a module that the page lists.
_MOST = 10


def formats() -> dict[str, str]:
    """Return the tables of formats with their titles as headings."""
    parts = []
    for title, rows in sections().items():
        columns = [c for c in rows[0] if any(row[c] != "none" for row in rows)]
        marks = {"format": "**", "suffixes": "`"}
        cells = [
            tuple(f"{(m := marks.get(c, ''))}{r[c]}{m}".replace("none", "") for c in columns)
            for r in rows
        ]
        parts += [f"## {title.capitalize()}", pages.table(tuple(columns), cells)]
    text = "\n\n".join(part.strip() for part in parts)
    return {"formats": re.sub(r"(--[a-z][a-z-]+)", r"`\1`", text)}


#: Functions that return the parts of a page, by the name of its file.
PAGES = {
    "commands.md": commands, "python.md": names, "parameters.md": parameters.parts,
    "formats.md": formats,
}  # fmt: skip


@program(option("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs")))
def main(args: argparse.Namespace) -> None:
    """Write the tables into their pages."""
    for name, made in PAGES.items():
        pages.update(args.output / name, made())
        print(f"wrote {args.output / name}")
