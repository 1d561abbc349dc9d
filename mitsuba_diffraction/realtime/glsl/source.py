"""Shader sources: one body for desktop OpenGL 3.3 and for WebGL 2, with a preamble each.

For other programs what a surface lacks is left out, and global names are out of their way.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from typing import Literal

from ...errors import DiffractionError
from .texels import PAGE

Dialect = Literal["desktop", "web"]

#: Methods of the fragment stage.
METHODS = ("lut", "spectral", "flss", "nmm", "pq")
#: Those of the 2014 thesis; `thesis.methods` evaluates them in NumPy.
THESIS_METHODS = METHODS[2:]

#: Lights at once.
LIGHTS = 4

_CONSTANTS = {
    "PAGE": str(PAGE), "PAGE_BITS": str(PAGE.bit_length() - 1), "LIGHTS": str(LIGHTS),
    "SURFACE_KIND": "0", "LIGHTS_LIT": "1",
}  # fmt: skip

_PREAMBLES = {
    "desktop": "#version 330 core\n",
    "web": (
        "#version 300 es\nprecision highp float;\nprecision highp int;\n"
        "precision highp sampler2D;\nprecision highp usampler2D;\n"
    ),
}

_NAME = re.compile(r"[A-Za-z_]\w*")
_TYPES = r"(?:float|int|bool|void|u?sampler2D|[iu]?vec[234]|mat[34]|NUMBER)"
_GLOBAL = re.compile(rf"(?:uniform |const )?{_TYPES} (\w[^;={{(]*)")


@functools.cache
def shader_file(name: str) -> str:
    """The text of one of the shaders' files."""
    return resources.files(__package__).joinpath("shaders", name).read_text(encoding="utf-8")


def vertex_source(dialect: Dialect = "desktop", name: str = "surface.vert") -> str:
    """The vertex stage, the same for all methods."""
    return _PREAMBLES[dialect] + shader_file(name)


def fragment_source(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> str:
    """The fragment stage of a method.

    definitions : what the surface and the tables ask for (`Packed.definitions`).
    dialect : "desktop" is GLSL 3.30 core, "web" GLSL ES 3.00.
    main : the file with the main function.

    Raises a DiffractionError if there is no such method.
    """
    return "".join(text for _, text in fragment_parts(method, definitions, dialect, main))


def fragment_parts(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> list[tuple[str, str]]:
    """The names and texts that `fragment_source` joins; parameters and errors as there."""
    if method not in METHODS:
        raise DiffractionError(f"method={method!r} is unknown; choose one of {', '.join(METHODS)}")
    constants = _CONSTANTS | dict(definitions)
    lines = [f"#define {name} {value}\n" for name, value in constants.items()]
    parts = [("preamble", _PREAMBLES[dialect] + "".join(lines))]
    shared = ["library.glsl", "boundary.glsl"]
    if method in THESIS_METHODS:
        shared.append("taylor.glsl")
    if "SHADOWED" in constants:
        shared.append("shadow.glsl")
    shared.append("layers.glsl")
    if "SECOND_ORDER" in constants:
        shared.append("second_order.glsl")
    if "DIFFRACTING" in constants:
        shared.append("pair.glsl")
    if "GLOSS" in constants:
        shared.append("gloss.glsl")
    if "WEIGHTED" in constants or "LOOKED_UP" in constants:
        shared += ["obstacles.glsl", "surroundings.glsl", "lobes.glsl"]
    shared.append(f"{method}.glsl")
    if "DIFFRACTING" in constants:
        shared.append("diffraction.glsl")
    return parts + [(name, shader_file(name)) for name in (*shared, main)]


def plain_source(
    name: str,
    shared: Sequence[str] = (),
    definitions: Mapping[str, str] | None = None,
    dialect: Dialect = "desktop",
) -> str:
    """A stage that knows neither surfaces nor tables.

    shared : files that it uses.
    """
    constants = _CONSTANTS | dict(definitions or {})
    lines = [f"#define {key} {value}\n" for key, value in constants.items()]
    return _PREAMBLES[dialect] + "".join((*lines, *map(shader_file, shared), shader_file(name)))


_COMPARISONS = {"==": operator.eq, "!=": operator.ne, ">": operator.gt, "<": operator.lt}


def resolved(source: str, definitions: Mapping[str, str]) -> str:
    """A source without its conditions: only lines that are compiled with these definitions.

    Definitions in the source count as well, and stay.
    """
    known, kept = dict(definitions), []
    nest: list[tuple[bool, bool]] = []  # whether lines are kept, whether a branch has been
    for line in source.splitlines():
        word, _, rest = line.strip().partition(" ")
        active = all(now for now, _ in nest)
        if word in ("#ifdef", "#ifndef", "#if"):
            holds = active and _holds(word, rest, known)
            nest.append((holds, holds))
        elif word in ("#elif", "#else"):
            _, taken = nest.pop()
            outer = all(now for now, _ in nest)
            holds = outer and not taken and (word == "#else" or _holds("#if", rest, known))
            nest.append((holds, taken or holds))
        elif word == "#endif":
            nest.pop()
        elif active:
            if word == "#define":
                name, _, value = rest.partition(" ")
                known[name.partition("(")[0]] = value
            kept.append(line)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(kept)).strip() + "\n"


def _holds(word: str, rest: str, known: Mapping[str, str]) -> bool:
    """Whether a condition holds: `A`, or terms `defined(A)` and comparisons joined by &&."""
    if word != "#if":
        return (rest.split()[0] in known) == (word == "#ifdef")
    return all(_term(term.strip(), known) for term in rest.split("&&"))


def _term(term: str, known: Mapping[str, str]) -> bool:
    found = re.fullmatch(r"(!?)defined\((\w+)\)", term)
    if found:
        return (found[2] in known) != bool(found[1])
    left, sign, right = term.split()
    a, b = _number(left, known), _number(right, known)
    return bool(_COMPARISONS[sign](a, b))


def _number(word: str, known: Mapping[str, str]) -> int:
    while word in known:
        word = known[word].split()[0]
    return int(word)


def global_names(source: str) -> set[str]:
    """Names that a resolved source declares outside functions, macros among them."""
    found: set[str] = set()
    for line in source.splitlines():
        code = line.partition("//")[0]
        if code.startswith("#define "):
            found.add(_NAME.findall(code)[1])
        elif match := _GLOBAL.match(code):
            found |= {_NAME.findall(part)[0] for part in match[1].split(",") if _NAME.search(part)}
    return found


def renamed(source: str, prefixes: Iterable[tuple[str, set[str]]]) -> str:
    """A source whose names begin with a prefix, shorter: comments only where something is declared.

    prefixes : each with the names that get it.
    """
    new = {name: prefix + name for prefix, names in prefixes for name in names}
    lines = []
    for line in source.split("\n"):
        code, mark, comment = line.partition("//")
        code = re.sub(r"(?<![.\w])[A-Za-z_]\w*", lambda m: new.get(m[0], m[0]), code)
        indent = (len(code) - len(code.lstrip(" "))) // 4
        declared = f" {mark}{comment}" if code.startswith("uniform") and mark else ""
        lines.append(("\t" * indent + code.strip(" ") + declared).rstrip())
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines))


def pruned(source: str, prefix: str) -> str:
    """A resolved source without functions, constants and macros of this prefix that none reads."""
    body = r"\(.*\)(?: {.*}|\n{\n(?s:.*?)^})| = .*;"
    of_type, macro = rf"(?:const )?{_TYPES} ({prefix}\w+)(?:{body})", rf"#define ({prefix}\w+) .*"
    pattern = re.compile(rf"(?m)^(?:{of_type}|{macro})\n+")

    def kept(found: re.Match[str]) -> str:
        name = found[1] or found[2]
        return found[0] if len(re.findall(rf"\b{name}\b", source)) > 1 else ""

    while (shorter := pattern.sub(kept, source)) != source:
        source = shorter
    return source
