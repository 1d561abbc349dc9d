"""Files of shaders, and sources rewritten for other programs.

Sources for other programs omit the code of features that a surface lacks, and prefix global names.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Iterable, Mapping
from importlib import resources

_NAME = re.compile(r"[A-Za-z_]\w*")
_TYPES = r"(?:float|int|bool|void|u?sampler2D|[iu]?vec[234]|mat[34]|NUMBER)"
_GLOBAL = re.compile(rf"(?:uniform |const )?{_TYPES} (\w[^;={{(]*)")


@functools.cache
def shader_file(name: str, folder: str = "shaders") -> str:
    """Read a shader file, or one of the example in the folder `three`."""
    return resources.files(__package__).joinpath(folder, name).read_text(encoding="utf-8")


@functools.cache
def declared_names() -> frozenset[str]:
    """Return the names of all shader files that no function of `formulas` may have."""
    files = resources.files(__package__).joinpath("shaders").iterdir()
    return frozenset(name for file in files for name in global_names(shader_file(file.name)))


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
    """Prefix names in a source, and remove comments except of uniforms and functions.

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
