"""What Mitsuba says, errors and warnings, as the lines of this command line.

Mitsuba 3.9 throws RuntimeError (ImportError for variants) with a text such as

    [parser.cpp:1718] At a.xml (line 8, col 25): failed to instantiate bsdf plugin of type "x": ...

in which nested causes are separated by line ends and an exception of a Python plugin is a whole
traceback; warnings go to a logger of its own.
"""

from __future__ import annotations

import re
from pathlib import PurePath

from ..errors import DiffractionError, one_line

_SOURCE_LINE = re.compile(r"\[[\w./]+\.(?:cpp|h|py):\d+\]\s*")
_LOADING = re.compile(
    r"(?:While loading|Error while loading|At) (?P<file>.+?) \((?P<line>line \d+), col \d+\): "
)
_INSTANTIATE = re.compile(r'failed to instantiate (?P<kind>\w+) plugin of type "(?P<type>[^"]+)": ')
_NOT_FOUND = re.compile(r'\[PluginManager\] Plugin "[^"]+" not found!')
_TRACEBACK = re.compile(r"Traceback \(most recent call last\):\n(?:[ \t].*\n)*(?:[\w.]+: (?=\S))?")
# What a Python plugin raises that says nothing of the scene
_NO_ERROR = re.compile(r"^(KeyboardInterrupt|MemoryError|SystemExit): ?(\d*)", re.M)
_UNREAD = re.compile(
    r'Found \d+ unreferenced (?:property|properties) in (\w+) plugin of type "([^"]+)":'
)
_NO_PLY = re.compile(
    r'Error while loading PLY file "(?P<file>[^"]+)": (?:"[^"]+": )?'
    r"(?P<why>(?:invalid PLY|incompatible contents|trailing tokens) .*)"
)
_UNUSED = re.compile(r"Found unused parameters?: (?P<list>.*)")
_PLUGIN = re.compile(r"\[[A-Z]\w+\] ")


def plain_text(error: BaseException) -> str:
    """The text of one of Mitsuba's exceptions as one line: where in the scene, and what is wrong.

    The places in Mitsuba's own sources, the tracebacks of Python plugins and repeated
    "while loading" are left out.
    """
    text = _TRACEBACK.sub("", _SOURCE_LINE.sub("", _words(error)))
    places = [(m["file"], m["line"]) for m in _LOADING.finditer(text)]
    text = _LOADING.sub("", text)
    # "no plugin of this kind" is the cause, not a consequence of failing to make one
    text = re.sub(
        _INSTANTIATE.pattern + _NOT_FOUND.pattern,
        lambda m: f"there is no {m['kind']} plugin {m['type']!r}; check the name",
        text,
    )
    text = _UNREAD.sub(lambda m: f"{m[1]} {m[2]!r} has no such parameter:", text)
    text = _NO_PLY.sub(_no_ply, text)
    text = re.sub(r"\n\s*- ", " ", text)  # lists
    text = _UNUSED.sub(_unused, text)
    text = _INSTANTIATE.sub(lambda m: f"{m['kind']} {m['type']!r}: ", text)
    text = one_line(_PLUGIN.sub("", text)).rstrip(" .!")
    if places:
        file, line = places[-1]
        text = f"'{file}', {line}: {text}"
    return text


def error_of(what: str, error: BaseException) -> BaseException:
    """What to raise for one of Mitsuba's exceptions.

    Mitsuba makes a RuntimeError of whatever a Python plugin raises: Ctrl-C, an exit and lack of
    memory are themselves again, anything else is a DiffractionError that begins with `what`.
    """
    found = _NO_ERROR.search(_words(error))
    if found is None:
        return DiffractionError(f"{what}: {plain_text(error)}")
    if found[1] == "SystemExit":
        return SystemExit(int(found[2] or 1))
    return KeyboardInterrupt() if found[1] == "KeyboardInterrupt" else MemoryError()


def _words(error: BaseException) -> str:
    """Its text; a text that is no UTF-8, as it quotes a damaged scene, reaches us as bytes."""
    if isinstance(error, UnicodeDecodeError):
        return error.object.decode("utf-8", "replace")
    return str(error)


def _no_ply(found: re.Match[str]) -> str:
    """A mesh of another format where a PLY is expected, with what to do about it."""
    file = PurePath(found["file"])
    todo = f"run 'mitsuba-diffraction tangents {file} -o mesh.ply' first, and use mesh.ply"
    if not found["why"].startswith("invalid PLY"):
        return f"'{file}' has polygons, of which Mitsuba reads only triangles: {todo}"
    if file.suffix.lower() in (".ply", ""):
        return f"'{file}' is no undamaged PLY: {found['why']}; export the mesh again"
    if file.suffix.lower() not in (".obj", ".serialized"):
        todo = "convert it to PLY or OBJ"
    return f"'{file}' is no PLY mesh, which the scene expects: {todo}"


def _unused(found: re.Match[str]) -> str:
    """Parameters that are given and that nothing in the scene reads."""
    names = re.findall(r"\$(\w+)=", found["list"])
    if not names:
        return found[0]
    return (
        f"nothing in the scene uses {', '.join('$' + name for name in names)}, although it "
        f"declares it: write ${names[0]} where its value is to go, or leave "
        f"{', '.join(names)} out of -D, --animate and --turn"
    )
