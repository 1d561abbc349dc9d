"""Mitsuba's errors in one line.

Mitsuba 3.9 throws RuntimeError with a text such as

    [parser.cpp:1718] At a.xml (line 8, col 25): failed to instantiate bsdf plugin of type "x": ...

in which nested causes are separated by line ends, and an exception of a Python plugin is a whole
traceback.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from ..errors import DiffractionError, one_line

_SOURCE_LINE = re.compile(
    r'\[[\w./]+\.(?:cpp|h|py):\d+\]\s*(?:At dictionary node "root": )?'  # of a preset's own BSDF
)
_LOADING = re.compile(
    r"(?:While loading|Error while loading|At) (?P<file>.+?) \((?P<line>line \d+), col \d+\): "
)
# What Mitsuba says of a file before the mistake: its plugin, and the file
_OF_FILE = re.compile(r'^(?:.*(?:file|of type) "[^"]*": )?(?:\[\w+\] )?(?:"[^"]*": )?')
_INSTANTIATE = r'failed to instantiate (\w+) plugin of type "([^"]+)": '
_TRACEBACK = re.compile(r"Traceback \(most recent call last\):\n(?:[ \t].*\n)*(?:[\w.]+: (?=\S))?")
# Exceptions of a Python plugin that say nothing about the scene
_NO_ERROR = re.compile(r"^(KeyboardInterrupt|MemoryError|SystemExit): ?(\d*)", re.M)


def _unused(match: re.Match[str]) -> str:
    """Name parameters that are given and that nothing in the scene reads."""
    names = re.findall(r"\$(\w+)=", match[1])
    if not names:
        return match[0]
    return (
        f"no object of the scene uses {', '.join('$' + name for name in names)}, although it "
        f"declares it: write ${names[0]} where its value is to go, or leave "
        f"{', '.join(names)} out"
    )


def _relative(match: re.Match[str]) -> str:
    """Show an index of an OBJ file below 0, to which Mitsuba adds 2^32, as the file has it."""
    return (
        f"it names {match[1]} {int(match[2]) - (1 << 32)}, counted back from the last, which "
        "Mitsuba does not read"
    )


# Mitsuba's words, in this order, and ours
_REWRITTEN: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    # "no plugin of this kind" is the cause, not a consequence of failing to make one
    (_INSTANTIATE + r'\[PluginManager\] Plugin "[^"]+" not found!',
     r"there is no \1 plugin '\2'; check the name"),
    (r'Found \d+ unreferenced (?:property|properties) in (\w+) plugin of type "([^"]+)":',
     r"\1 '\2' has no such parameter:"),
    (r'Error while loading PLY file "([^"]+)": (?:"[^"]+": )?'
     r"(?:incompatible contents|trailing tokens) .*",
     r"'\1' has polygons, of which Mitsuba reads only triangles: run the command 'tangents \1 "
     r"-o mesh.ply' first, and use mesh.ply"),
    (r"\n\s*- ", " "),  # lists
    (r"Found unused parameters?: (.*)", _unused),
    (_INSTANTIATE, r"\1 '\2': "),
    (r"\[[A-Z]\w+\] ", ""),  # plugins
    (r"reference to invalid (vertex|normal|texture coordinate) ([2-4]\d{9})\b", _relative),
)  # fmt: skip


def plain_text(error: BaseException) -> str:
    """Return the text of Mitsuba's exception as one line: where in the scene, and the mistake.

    The places in Mitsuba's own sources, the tracebacks of Python plugins and repeated "while
    loading" are left out.
    """
    text = _TRACEBACK.sub("", _SOURCE_LINE.sub("", _words(error)))
    places = [(m["file"], m["line"]) for m in _LOADING.finditer(text)]
    text = _LOADING.sub("", text)
    for words, ours in _REWRITTEN:
        text = re.sub(words, ours, text)
    text = one_line(text).rstrip(" .!")
    if places:
        file, line = places[-1]
        text = f"'{file}', {line}: {text}"
    return text


def reason_of(error: BaseException) -> str:
    """Return why Mitsuba cannot read a file, without the file's name; else the error's name."""
    text = _SOURCE_LINE.sub("", one_line(_words(error)))
    text = re.sub(*_REWRITTEN[-1], _OF_FILE.sub("", text)).rstrip(" .!")
    return text[-200:] or type(error).__name__


def error_of(failed: str, error: BaseException) -> BaseException:
    """Return the error to raise for Mitsuba's exception.

    Mitsuba makes a RuntimeError of whatever a Python plugin raises: Ctrl-C, an exit and lack of
    memory are themselves again, anything else is a DiffractionError that begins with `failed`.
    """
    original = _NO_ERROR.search(_words(error))
    if original is None:
        return DiffractionError(f"{failed}: {plain_text(error)}")
    if original[1] == "SystemExit":
        return SystemExit(int(original[2] or 1))
    return KeyboardInterrupt() if original[1] == "KeyboardInterrupt" else MemoryError()


def _words(error: BaseException) -> str:
    """Return the text of an exception; damaged scenes are quoted as bytes that are not UTF-8."""
    if isinstance(error, UnicodeDecodeError):
        return error.object.decode("utf-8", "replace")
    return str(error)
