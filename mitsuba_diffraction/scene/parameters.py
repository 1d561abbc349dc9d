"""Parameters of an XML scene, so that a misspelt one is answered with the names there are."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..errors import DiffractionError, quoted
from ..files import FileKind, kind_of, refuse_pipe
from ..gltf import named_files
from ..heights.lengths import numbers_of
from ..inputs import note_input
from ..limits import DEEPEST_ELEMENT, DEEPEST_INCLUDE, MOST_INCLUDES, check_count
from .stage import STUDIO

_REFERENCE = re.compile(r"\$(\w+)")
# Parameters of Mitsuba's plugins and of this package's whose text is the name of a file.
_FILES = ("filename", "heightfield", "table", "layers", "pigment")

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
            hint = "; put heights on the id of a BSDF or shape: --assign ID=FILE,material=Al"
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

    Raises a DiffractionError if an include is a pipe, or outside of the scene's folder.
    """
    document = _Document.of_scene(scene, values)
    try:
        for element, _ in document.elements():
            for value in element.attrib.values() if element.tag != "default" else ():
                for name in _REFERENCE.findall(value):
                    document.defaults.setdefault(name, None)
    except _Unreadable:
        return None
    return document.defaults


def files_of(
    scene: Path, values: Mapping[str, str] | None = None, *, with_sources: bool = True
) -> list[Path]:
    """List the scene, its includes, and every file that plugins, recipes or glTF files read.

    Raises a DiffractionError if a file is a pipe or a device, for which Mitsuba would wait; if an
    include lies outside of the scene's folder; or if a recipe is wrong.

    with_sources : whether recipes are read, for the files that they name.
    """
    from ..heights import Source

    files: dict[Path, None] = {}
    waiting = [scene]
    if scene.suffix.lower() == ".xml":  # else heights or a recipe
        document = _Document.of_scene(scene, values)
        with contextlib.suppress(_Unreadable):
            for element, folders in document.elements():
                text = ""
                # Mitsuba looks for included files and spectra beside the file that names them
                if element.tag in ("include", "spectrum"):
                    text = element.get("filename", "")
                elif element.tag == "string" and element.get("name") in _FILES:
                    text, folders = element.get("value", ""), folders[1:]
                if text:
                    waiting.append(_found(document.filled(text), folders))
    while waiting:
        file = waiting.pop()
        refuse_pipe(file)
        if file in files or not os.path.isfile(file):  # Path.is_file() raises for long names
            continue
        files[file] = None
        waiting += named_files(file)
        if with_sources and kind_of(file) is FileKind.RECIPE:
            waiting += Source.of(file).files
    return list(files)


def note_files(file: Path, values: Mapping[str, str] | None = None) -> None:
    """Note as inputs a file and all that it names, if it is a scene or a recipe.

    A file that is wrong is left to its reader, who refuses it.
    """
    note_input(file)
    with contextlib.suppress(DiffractionError):
        for named in files_of(file, values):
            note_input(named)


class _Unreadable(Exception):
    """An included file is missing, and Mitsuba says so."""


@dataclass(frozen=True)
class _Document:
    """A scene, or a file that it includes.

    Attributes
    ----------
    file : the file.
    folders : where Mitsuba looks for a name, after the file's own folder.
    roots : folders within which includes have to lie.
    values : of parameters that the user has set: files that they name may lie anywhere.
    defaults : of all parameters so far; None without one.
    depth : of includes within each other.
    includes : number of includes of the scene so far, for each of which Mitsuba reads a file.
    """

    file: Path
    folders: tuple[Path, ...]
    roots: tuple[Path, ...]
    values: Mapping[str, str]
    defaults: dict[str, str | None] = field(default_factory=dict)
    depth: int = 0
    includes: list[int] = field(default_factory=lambda: [0])

    @classmethod
    def of_scene(cls, scene: Path, values: Mapping[str, str] | None) -> _Document:
        # the package's own scenes may be included from everywhere
        roots = (scene.parent, STUDIO.parent)
        return cls(scene, (scene.parent, Path.cwd()), roots, values or {})

    def root(self) -> ElementTree.Element:
        """Return the outermost element.

        Raises a DiffractionError for pipes, malformed XML, and elements too far within each other.
        """
        refuse_pipe(self.file)
        if self.depth > DEEPEST_INCLUDE or not os.path.isfile(self.file):
            raise _Unreadable
        depth = 0
        try:
            with open(self.file, "rb") as stream:
                for event, element in ElementTree.iterparse(stream, ("start", "end")):
                    depth += 1 if event == "start" else -1
                    check_count(
                        depth, DEEPEST_ELEMENT, f"'{self.file}'", "elements within each other"
                    )
                    if depth == 0:
                        root = element
            return root
        except ElementTree.ParseError as error:
            raise DiffractionError(
                f"'{self.file}' is malformed XML ({error}); mend it, since Mitsuba may read it "
                "differently"
            ) from error
        except DiffractionError:
            raise
        except (OSError, ValueError) as error:
            raise _Unreadable from error

    def elements(self) -> Iterator[tuple[ElementTree.Element, tuple[Path, ...]]]:
        """Yield the elements of the file and of its includes, in Mitsuba's order.

        With each come the folders in which Mitsuba 3.9 looks for a name; the first is the folder of
        the element's file.
        """
        folders = self.folders
        for element in self.root().iter():
            around, name = (self.file.parent, *folders), element.get("name", "")
            if element.tag == "default" and self.defaults.get(name) is None:
                self.defaults[name] = element.get("value", "")  # the first counts, as in Mitsuba
            yield element, around
            if element.tag == "path":
                folders = (self.inner(element.get("value", ""), around).file, *folders)
            elif element.tag == "include":
                inner = self.inner(element.get("filename", ""), around)
                self.includes[0] += 1
                check_count(self.includes[0], MOST_INCLUDES, f"'{self.file}'", "includes so far")
                yield from inner.elements()

    def filled(self, text: str) -> str:
        """Return a text with parameters replaced by their values, as far as they have one."""
        return _REFERENCE.sub(
            lambda match: self.values.get(match[1]) or self.defaults.get(match[1]) or match[0], text
        )

    def inner(self, text: str, folders: tuple[Path, ...]) -> _Document:
        """Return an include, or the folder of a <path>, of this name.

        Raises a DiffractionError if it lies outside of all roots.
        """
        name, roots = self.filled(text), self.roots
        path = _found(name, folders)
        if text.startswith("$") and text[1:] in self.values:
            roots = (*roots, path.parent)
        elif not any(path.resolve().is_relative_to(folder.resolve()) for folder in roots):
            raise DiffractionError(
                f"'{self.file}' includes {quoted(name)}, which is outside of the scene's folder; "
                "copy it there, or make the name a parameter of the scene, and set that by -D"
            )
        return replace(self, file=path, folders=folders, roots=roots, depth=self.depth + 1)


def _found(name: str, folders: Sequence[Path]) -> Path:
    """Return the first path of this name that exists, or that in the first folder."""
    paths = [folder / name for folder in folders]
    return next((path for path in paths if os.path.lexists(path)), paths[0])


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
    pair = numbers_of(start), numbers_of(end)
    if not (pair[0] and pair[1] and len(pair[0]) == len(pair[1])):
        raise DiffractionError(
            f"expected numbers, as many before as after the colon, got {quoted(text)}"
        )
    return Change(name, pair[0], pair[1])


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
        begin = numbers_of(start or "") or ()
        if len(begin) != 1:
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
