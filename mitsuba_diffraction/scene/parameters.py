"""Parameters of an XML scene, so that a misspelt one is answered with the names there are."""

from __future__ import annotations

import contextlib
import difflib
import math
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import DiffractionError, quoted
from ..files import FileKind, kind_of, refuse_pipe

_REFERENCE = re.compile(r"\$(\w+)")
# Mitsuba stops at 15 includes within each other.
_DEEPEST = 15
# Longest path in characters: longer texts name no file, and asking would be an error.
_LONGEST = 1024

Numbers = tuple[float, ...]


def check_parameters(scene: Path, values: Mapping[str, str]) -> None:
    """Refuse parameters given on the command line that the scene, an XML file, does not have.

    Raises a DiffractionError if one is unknown; the text lists the scene's and its includes,
    with defaults.
    """
    known = parameters_of(scene, values)
    if known is None:
        return  # Mitsuba's own error describes the file
    for name in values:
        if name in known:
            continue
        if not known:
            raise DiffractionError(f"'{scene}' has no parameters; leave {name} out")
        listed = ", ".join(
            name if default is None else f"{name}={default}" for name, default in known.items()
        )
        close = difflib.get_close_matches(name, known, 1)
        hint = f"; did you mean {close[0]}?" if close else ""
        if name == "patch":
            hint = "; put heights on the id of a BSDF or shape: --material ID=FILE,material=Al"
        raise DiffractionError(
            f"'{scene}' has no parameter {name!r}; it has (with defaults) {listed}{hint}"
        )


def parameters_of(
    scene: Path, values: Mapping[str, str] | None = None
) -> dict[str, str | None] | None:
    """Names of a scene's parameters and their defaults, includes and all.

    A default is `None` where the scene uses a parameter without giving one, and so is the result as
    a whole if a file is missing or no XML.

    values : those that are set, which may occur in the names of included files.
    """
    defaults: dict[str, str | None] = {}
    return defaults if _collect(scene, dict(values or {}), defaults, 0) else None


def files_of(
    scene: Path, values: Mapping[str, str] | None = None, *, with_sources: bool = True
) -> list[Path]:
    """List the scene, its includes, and every file named by one of them or by a recipe they name.

    Raises a DiffractionError if one is a pipe or a device, for which Mitsuba would wait, or a
    recipe is wrong.

    with_sources : whether recipes are read, for the files that they name.
    """
    from ..heights.recipes import Recipe

    defaults = parameters_of(scene, values) or {}
    known = {name: value or "" for name, value in defaults.items()} | dict(values or {})
    files: dict[Path, None] = {}
    waiting = [scene]
    while waiting:
        file = waiting.pop()
        refuse_pipe(file)
        if file in files or not os.path.isfile(file):  # Path.is_file() raises for long names
            continue
        files[file] = None
        if with_sources and kind_of(file) is FileKind.RECIPE:
            waiting += Recipe.load(file).sources
        if file.suffix.lower() != ".xml":
            continue
        with contextlib.suppress(ElementTree.ParseError, ValueError):
            for element in ElementTree.parse(file).getroot().iter():
                for text in element.attrib.values():
                    named = _with_values(text, known, {})
                    if named and len(named) < _LONGEST and "\0" not in named:
                        waiting.append(scene.parent / named)
    return list(files)


def _collect(
    file: Path, values: Mapping[str, str], defaults: dict[str, str | None], depth: int
) -> bool:
    """Add the parameters of one file to `found`; whether it and its includes could be read."""
    if depth > _DEEPEST or not file.is_file():
        return False
    try:
        root = ElementTree.parse(file).getroot()
    except (OSError, ElementTree.ParseError, ValueError):
        return False
    for element in root.iter():
        if element.tag == "default":
            name = element.get("name", "")
            if defaults.get(name) is None:  # the first default counts, as in Mitsuba
                defaults[name] = element.get("value", "")
            continue
        for value in element.attrib.values():
            for name in _REFERENCE.findall(value):
                defaults.setdefault(name, None)
        if element.tag == "include":
            included = file.parent / _with_values(element.get("filename", ""), values, defaults)
            if not _collect(included, values, defaults, depth + 1):
                return False
    return True


def _with_values(text: str, values: Mapping[str, str], defaults: Mapping[str, str | None]) -> str:
    """The text with parameters replaced by their values, as far as they have one."""

    def value(match: re.Match[str]) -> str:
        return values.get(match[1]) or defaults.get(match[1]) or match[0]

    return _REFERENCE.sub(value, text)


@dataclass(frozen=True)
class Change:
    """A parameter that goes from one value to another; both have as many numbers."""

    name: str
    start: Numbers
    end: Numbers

    def at(self, share: float) -> str:
        """The value, as text for the scene, at a share of the way from 0 to 1."""
        steps = (a + (b - a) * share for a, b in zip(self.start, self.end, strict=True))
        return ", ".join(f"{value:.10g}" for value in steps)


def change_of(text: str) -> Change:
    """KEY=FROM:TO, where FROM and TO are numbers, or lists of them with commas between.

    Raises a DiffractionError if it is not one.
    """
    name, equals, values = text.partition("=")
    start, colon, end = values.partition(":")
    if not (name and equals and colon):
        raise DiffractionError(f"expected KEY=FROM:TO, e.g. sun_azimuth=0:90, got {quoted(text)}")
    pair = numbers_in(start), numbers_in(end)
    if pair[0] is None or pair[1] is None or len(pair[0]) != len(pair[1]):
        raise DiffractionError(
            f"expected numbers, as many before as after the colon, got {quoted(text)}"
        )
    return Change(name, pair[0], pair[1])


def numbers_in(text: str) -> Numbers | None:
    """The finite numbers of a list with commas between, or None if it is not one."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    return values if all(map(math.isfinite, values)) else None


def values_of_frames(
    scene: Path,
    fixed: Mapping[str, str],
    count: int,
    changes: Sequence[Change],
    turns: Sequence[str],
) -> list[dict[str, str]]:
    """Parameters of the scene for each of `count` frames.

    fixed : parameters that stay.
    changes : from the first frame to the last, both ends included.
    turns : names of angles in degrees that turn once around, beginning where the scene has them;
        the last frame is one step before the first, so that their film closes.

    Raises a DiffractionError if an angle to be turned has no value to begin with, or one that is no
    number.
    """
    around = []
    for name in turns:
        start = fixed.get(name) or (parameters_of(scene, fixed) or {}).get(name, "0")
        begin = numbers_in(start or "")
        if begin is None or len(begin) != 1:
            raise DiffractionError(
                f"the turn of {name} begins at {start!r}, which is not an angle in degrees; give a "
                f"number: {name}=0"
            )
        around.append(Change(name, begin, (begin[0] + 360.0,)))
    frames = []
    for n in range(count):
        values = dict(fixed)
        values |= {change.name: change.at(n / max(1, count - 1)) for change in changes}
        values |= {change.name: change.at(n / count) for change in around}
        frames.append(values)
    return frames
