"""Files of shaders, and sources for other programs, whose global names get a prefix."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from importlib import resources

_NAME = re.compile(r"[A-Za-z_]\w*")
_TYPES = r"(?:float|int|bool|void|u?sampler2D|[iu]?vec[234]|mat[34]|NUMBER)"
_GLOBAL = re.compile(rf"(?:uniform |const )?{_TYPES} (\w[^;={{(]*)")


@functools.cache
def shader_file(name: str, package: str = "") -> str:
    """Read a file of the folder `shaders`, or of another package's folder."""
    files = (
        resources.files(package) if package else resources.files(__package__).joinpath("shaders")
    )
    return files.joinpath(name).read_text(encoding="utf-8")


def global_names(source: str) -> set[str]:
    """Return the names that a source declares outside functions, including macros."""
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
