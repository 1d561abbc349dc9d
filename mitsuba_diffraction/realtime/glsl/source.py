"""Shader sources: one body for desktop OpenGL 3.3 and WebGL 2, with a preamble for each.

Sources for other programs omit the code of features that a surface lacks, and prefix global names.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from typing import Literal

from ...errors import DiffractionError
from ...optics.display import check_view
from .formulas import formulas
from .texels import PAGE

Dialect = Literal["desktop", "web"]

#: Methods of the fragment stage.
METHODS = ("fast", "exact", "flss", "nmm", "pq")
#: Methods of the 2014 thesis; `thesis.methods` evaluates them in NumPy.
THESIS_METHODS = METHODS[2:]

#: Largest number of lights in one draw call.
LIGHTS = 4

_CONSTANTS = {
    "PAGE": str(PAGE), "PAGE_BITS": str(PAGE.bit_length() - 1), "LIGHTS": str(LIGHTS),
    "SURFACE_KIND": "0", "LIGHTS_LIT": "1", "TEXELS": "1", "TAPS_X": "1", "TAPS_Y": "1",
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
    """Read a shader file."""
    return resources.files(__package__).joinpath("shaders", name).read_text(encoding="utf-8")


def vertex_source(dialect: Dialect = "desktop", name: str = "surface.vert") -> str:
    """Return the source of the vertex stage, which all methods share."""
    return _PREAMBLES[dialect] + shader_file(name)


def fragment_source(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> str:
    """Return the source of a method's fragment stage.

    definitions : definitions of the surface, the tables and the light (`Packed.definitions`).
    dialect : "desktop" is GLSL 3.30 core, "web" GLSL ES 3.00.
    main : file with the main function.

    Raises a DiffractionError if the method is unknown.
    """
    return "".join(text for _, text in fragment_parts(method, definitions, dialect, main))


def fragment_parts(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> list[tuple[str, str]]:
    """Return names and texts of the parts of `fragment_source`; parameters and errors as there."""
    if method not in METHODS:
        raise DiffractionError(f"method={method!r} is unknown; choose one of {', '.join(METHODS)}")
    known = _CONSTANTS | dict(definitions)
    lines = [f"#define {name} {value}\n" for name, value in known.items()]
    parts = [("preamble", _PREAMBLES[dialect] + "".join(lines))]
    shared = ["library.glsl", "formulas", "reflectance.glsl", "frame.glsl", "boundary.glsl"]
    if method in THESIS_METHODS:
        shared.append("taylor.glsl")
    if "SHADOWED" in known:
        shared.append("shadow.glsl")
    shared.append("layers.glsl")
    if "SECOND_ORDER" in known:
        shared.append("second_order.glsl")
    if "ORDERS" in known:
        shared.append("orders.glsl")
    elif "DIFFRACTING" in known:
        shared.append("pair.glsl")
    if "GLOSS" in known:
        shared.append("gloss.glsl")
    if "WEIGHTED" in known or "LOOKED_UP" in known:
        shared += ["obstacles.glsl", "surroundings.glsl", "lobes.glsl"]
    shared += method_files(method, known)
    return parts + [(name, part(name, known)) for name in (*shared, main)]


def part(name: str, definitions: Mapping[str, str]) -> str:
    """Return the text of a file, or of `formulas`."""
    return formulas(definitions) if name == "formulas" else shader_file(name)


def method_files(method: str, definitions: Mapping[str, str]) -> list[str]:
    """Return the files of a method's `diffraction`."""
    files = ["responses.glsl"] if method == "exact" else []
    if "ORDERS" in definitions:
        return [*files, "orders_light.glsl"]
    files.append(f"{method}.glsl")
    return [*files, "diffraction.glsl"] if "DIFFRACTING" in definitions else files


def plain_source(
    name: str,
    shared: Sequence[str] = (),
    definitions: Mapping[str, str] | None = None,
    dialect: Dialect = "desktop",
) -> str:
    """Return the source of a stage that depends on neither surfaces nor tables.

    shared : files that it includes, or `formulas`.
    """
    known = _CONSTANTS | dict(definitions or {})
    lines = [f"#define {key} {value}\n" for key, value in known.items()]
    return _PREAMBLES[dialect] + "".join((*lines, *(part(n, known) for n in (*shared, name))))


def display_definitions(view: str) -> dict[str, str]:
    """Return the definitions with which shaders show light by a view, by `displayed`.

    Raises a DiffractionError if the view is unknown.
    """
    check_view(view)
    return {"DISPLAYED": ""} | ({"NATURAL": ""} if view == "natural" else {})


_COMPARISONS = {"==": operator.eq, "!=": operator.ne, ">": operator.gt, "<": operator.lt}


def resolved(source: str, definitions: Mapping[str, str]) -> str:
    """Evaluate a source's preprocessor conditions: keep only the lines that would be compiled.

    Definitions in the source count, too, and stay in it.
    """
    macros, kept = dict(definitions), []
    nest: list[tuple[bool, bool]] = []  # whether a branch is active, whether one has been
    for line in source.splitlines():
        word, _, rest = line.strip().partition(" ")
        active = all(now for now, _ in nest)
        if word in ("#ifdef", "#ifndef", "#if"):
            holds = active and _holds(word, rest, macros)
            nest.append((holds, holds))
        elif word in ("#elif", "#else"):
            _, done = nest.pop()
            outer = all(now for now, _ in nest)
            holds = outer and not done and (word == "#else" or _holds("#if", rest, macros))
            nest.append((holds, done or holds))
        elif word == "#endif":
            nest.pop()
        elif active:
            if word == "#define":
                name, _, value = rest.partition(" ")
                macros[name.partition("(")[0]] = value
            kept.append(line)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(kept)).strip() + "\n"


def _holds(word: str, rest: str, macros: Mapping[str, str]) -> bool:
    """Evaluate a condition: `A`, or terms `defined(A)` and comparisons joined by &&."""
    if word != "#if":
        return (rest.split()[0] in macros) == (word == "#ifdef")
    return all(_term(term.strip(), macros) for term in rest.split("&&"))


def _term(term: str, macros: Mapping[str, str]) -> bool:
    """Evaluate `defined(A)`, `!defined(A)` or a comparison of integers."""
    match = re.fullmatch(r"(!?)defined\((\w+)\)", term)
    if match:
        return (match[2] in macros) != bool(match[1])
    left, sign, right = term.split()
    a, b = _number(left, macros), _number(right, macros)
    return bool(_COMPARISONS[sign](a, b))


def _number(word: str, macros: Mapping[str, str]) -> int:
    """Value of an integer literal, or of a macro that stands for one."""
    while word in macros:
        word = macros[word].split()[0]
    return int(word)


def global_names(source: str) -> set[str]:
    """Return the names that a resolved source declares outside functions, including macros."""
    names: set[str] = set()
    for line in source.splitlines():
        code = line.partition("//")[0]
        if code.startswith("#define "):
            names.add(_NAME.findall(code)[1])
        elif match := _GLOBAL.match(code):
            names |= {_NAME.findall(part)[0] for part in match[1].split(",") if _NAME.search(part)}
    return names


def renamed(source: str, prefixes: Iterable[tuple[str, set[str]]]) -> str:
    """Prefix names in a source, and remove comments except those of uniforms and functions.

    prefixes : pairs of a prefix and the names that get it.
    """
    new = {name: prefix + name for prefix, names in prefixes for name in names}
    lines = []
    for line in source.split("\n"):
        code, mark, comment = line.partition("//")
        code = re.sub(r"(?<![.\w])[A-Za-z_]\w*", lambda m: new.get(m[0], m[0]), code)
        indent = (len(code) - len(code.lstrip(" "))) // 4
        kept = code.startswith("uniform") or line.startswith("// ")
        declared = f" {mark}{comment}" if kept and mark else ""
        lines.append(("\t" * indent + (code.strip(" ") + declared).strip(" ")).rstrip())
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines))


def pruned(source: str, prefix: str) -> str:
    """Remove unused functions, constants and macros with this prefix from a resolved source."""
    body = r"\([^()]*\)(?: {.*}|\n{\n(?s:.*?)^})| = .*;"
    of_type, macro = rf"(?:const )?{_TYPES} ({prefix}\w+)(?:{body})", rf"#define ({prefix}\w+) .*"
    pattern = re.compile(rf"(?m)(?:^// .*\n)*^(?:{of_type}|{macro})\n+")

    def if_used(match: re.Match[str]) -> str:
        """Return the definition if its name occurs elsewhere, or else nothing."""
        name = match[1] or match[2]
        return match[0] if len(re.findall(rf"\b{name}\b", source)) > 1 else ""

    while (shorter := pattern.sub(if_used, source)) != source:
        source = shorter
    return source
