"""Shader text for other programs: what a surface lacks left out, global names out of their way."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

_NAME = re.compile(r"[A-Za-z_]\w*")
_TYPES = r"(?:float|int|bool|void|u?sampler2D|[iu]?vec[234]|mat[34]|NUMBER)"
_GLOBAL = re.compile(rf"(?:uniform |const )?{_TYPES} (\w[^;={{(]*)")


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
    """Whether a condition holds: `A`, or terms `defined(A)`, `A == B`, `A > B` joined by &&."""
    if word != "#if":
        return (rest.split()[0] in known) == (word == "#ifdef")
    return all(_term(term.strip(), known) for term in rest.split("&&"))


def _term(term: str, known: Mapping[str, str]) -> bool:
    found = re.fullmatch(r"(!?)defined\((\w+)\)", term)
    if found:
        return (found[2] in known) != bool(found[1])
    left, sign, right = term.split()
    a, b = _number(left, known), _number(right, known)
    return a > b if sign == ">" else a == b


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
        declared = mark + comment if code.startswith("uniform") else ""
        lines.append("\t" * indent + f"{code.lstrip(' ')}{declared}".rstrip())
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines))
