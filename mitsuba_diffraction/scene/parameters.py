"""Parameters of an XML scene, so that a misspelt one is answered with the names there are."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import DiffractionError, quoted
from ..files import FileKind, kind_of, refuse_pipe
from ..gltf import named_files
from ..heights.lengths import numbers_of
from ..inputs import note_input
from ..limits import DEEPEST_ELEMENT, DEEPEST_INCLUDE, MOST_INCLUDES, check_count
from ..plugin.parameters import NAMES, REFLECTING
from .orbit import ORBIT
from .stage import STUDIO

#: Prefix of scene parameters that are surfaces for ids: `material:ID` = `FILE[,parameter=value…]`.
MATERIAL = "material:"
#: Scene parameter that limits samples, in units of white.
CLAMP = "render:clamp"
_REFERENCE = re.compile(r"\$(\w+)")
# Parameters of Mitsuba's plugins and of this package's whose text is the name of a file.
_FILES = ("filename", "heightfield", "table", "layers", "pigment")

Numbers = tuple[float, ...]


class SceneValues(NamedTuple):
    """Values for a scene.

    Attributes
    ----------
    parameters : of the scene's own parameters.
    defaults : of all the scene's parameters; None where the scene has none.
    materials : surfaces by the id that they are put on.
    surface : parameters of the BSDF, for all diffracting surfaces of the scene.
    clamp : limit of samples in units of white, or None.
    orbit : degrees by which the cameras are turned around the vertical.
    """

    parameters: dict[str, Any]
    defaults: dict[str, str | None]
    materials: dict[str, str]
    surface: dict[str, Any]
    clamp: float | None
    orbit: float


def scene_values(scene: Path, values: Mapping[str, Any]) -> SceneValues:
    """Separate values of a scene's parameters from surfaces for its ids and their parameters.

    The scene's parameters precede those of the BSDF.

    Raises a DiffractionError if the scene, an XML file, has no parameter of a name; the text lists
    the parameters of the scene and its includes, with defaults.
    """
    materials = {k[len(MATERIAL) :]: v for k, v in values.items() if k.startswith(MATERIAL)}
    own = (CLAMP, ORBIT)
    rest = {k: v for k, v in values.items() if not k.startswith(MATERIAL) and k not in own}
    known = parameters_of(scene, values)
    surface = {k: v for k, v in rest.items() if k not in (known or ()) and k in NAMES[REFLECTING]}
    parameters = {k: v for k, v in rest.items() if k not in surface}
    unknown = [name for name in parameters if known is not None and name not in known]
    if unknown and not known:
        raise DiffractionError(f"'{scene}' has no parameters; leave {unknown[0]} out")
    if known and unknown:
        listed = ", ".join(
            name if default is None else f"{name}={default}" for name, default in known.items()
        )
        close = difflib.get_close_matches(unknown[0], known, 1)
        hint = f"; did you mean {close[0]}?" if close else ""
        if unknown[0] == "patch":
            hint = "; put heights on the id of a BSDF or shape: --assign ID=FILE,material=Al"
        raise DiffractionError(
            f"'{scene}' has no parameter {unknown[0]!r}; it has (with defaults) {listed}{hint}"
        )
    clamp = float(values[CLAMP]) if CLAMP in values else None
    orbit = float(values.get(ORBIT, 0.0))
    return SceneValues(parameters, known or {}, materials, surface, clamp, orbit)


def parameters_of(
    scene: Path, values: Mapping[str, str] | None = None
) -> dict[str, str | None] | None:
    """Names of a scene's parameters and their defaults, includes and all.

    A default is `None` where the scene uses a parameter without giving one, and so is the result as
    a whole if a file is missing or no XML.

    values : those that are set, which may occur in the names of included files.

    Raises a DiffractionError if an include is a pipe, or outside of the scene's folder.
    """
    return _walked(scene, values)[0]


def files_of(scene: Path, values: Mapping[str, str] | None = None) -> list[Path]:
    """List the scene, its includes, and every file that plugins, recipes or glTF files read.

    Raises a DiffractionError if a file is a pipe or a device, for which Mitsuba would wait, or an
    include lies outside of the scene's folder.
    """
    from ..heights import Source

    files: dict[Path, None] = {}
    waiting = [scene]
    if scene.suffix.lower() == ".xml":  # else heights or a recipe
        waiting += _walked(scene, values)[1]
    while waiting:
        file = waiting.pop()
        refuse_pipe(file)
        if file in files or not os.path.isfile(file):  # Path.is_file() raises for long names
            continue
        files[file] = None
        waiting += named_files(file)
        if kind_of(file) is FileKind.RECIPE:
            with contextlib.suppress(DiffractionError):  # its reader refuses a wrong recipe
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


def _walked(
    scene: Path, values: Mapping[str, str] | None
) -> tuple[dict[str, str | None] | None, list[Path]]:
    """Return the result of `parameters_of`, and the files that the elements of a scene name."""
    walk = _Walk(values or {})
    try:
        # the package's own scenes may be included from everywhere
        walk.read(scene, (scene.parent, Path.cwd()), (scene.parent, STUDIO.parent))
    except _Unreadable:
        return None, walk.named
    return walk.defaults, walk.named


class _Walk:
    """Walk over a scene and its includes.

    Attributes
    ----------
    values : of parameters that the user has set: files that they name may lie anywhere.
    defaults : of all parameters so far; None without one.
    named : files that the elements name.
    includes : number of includes so far, for each of which Mitsuba reads a file.
    """

    def __init__(self, values: Mapping[str, str]) -> None:
        self.values, self.includes = values, 0
        self.defaults: dict[str, str | None] = {}
        self.named: list[Path] = []

    def read(
        self, file: Path, folders: Sequence[Path], roots: Sequence[Path], depth: int = 0
    ) -> None:
        """Read the elements of a file and of its includes, in Mitsuba's order.

        folders : where Mitsuba 3.9 looks for a name. Included files and spectra may lie beside the
            file that names them, too.
        roots : folders within which includes have to lie.
        depth : of includes within each other.
        """
        for element in _root(file, depth).iter():
            tag, name, around = element.tag, element.get("name", ""), (file.parent, *folders)
            text, value = element.get("filename", ""), element.get("value", "")
            if tag != "default":
                for each in _REFERENCE.findall(" ".join(element.attrib.values())):
                    self.defaults.setdefault(each, None)
            elif self.defaults.get(name) is None:
                self.defaults[name] = value  # the first counts, as in Mitsuba
            if tag in ("include", "spectrum") and text:
                self.named.append(_found(self.filled(text), around))
            elif tag == "string" and name in _FILES and value:
                self.named.append(_found(self.filled(value), folders))
            if tag == "path":
                folders = (self._inner(file, value, around, roots)[0], *folders)
            elif tag == "include":
                inner, allowed = self._inner(file, text, around, roots)
                self.includes += 1
                check_count(self.includes, MOST_INCLUDES, f"'{file}'", "includes so far")
                self.read(inner, folders, allowed, depth + 1)

    def filled(self, text: str) -> str:
        """Return a text with parameters replaced by their values, as far as they have one."""
        return _REFERENCE.sub(
            lambda match: self.values.get(match[1]) or self.defaults.get(match[1]) or match[0], text
        )

    def _inner(
        self, file: Path, text: str, folders: Sequence[Path], roots: Sequence[Path]
    ) -> tuple[Path, Sequence[Path]]:
        """Return an include, or the folder of a <path>, of this name, and the roots within it.

        Raises a DiffractionError if it lies outside of all roots.
        """
        name = self.filled(text)
        path = _found(name, folders)
        if text.startswith("$") and text[1:] in self.values:
            return path, (*roots, path.parent)
        if not any(path.resolve().is_relative_to(folder.resolve()) for folder in roots):
            raise DiffractionError(
                f"'{file}' includes {quoted(name)}, which is outside of the scene's folder; "
                "copy it there, or make the name a parameter of the scene, and set that by -D"
            )
        return path, roots


def _root(file: Path, depth: int) -> ElementTree.Element:
    """Return the outermost element of a file that is included at this depth.

    Raises a DiffractionError for pipes, malformed XML, and elements too far within each other.
    """
    refuse_pipe(file)
    if depth > DEEPEST_INCLUDE or not os.path.isfile(file):
        raise _Unreadable
    depth = 0
    try:
        with open(file, "rb") as stream:
            for event, element in ElementTree.iterparse(stream, ("start", "end")):
                depth += 1 if event == "start" else -1
                check_count(depth, DEEPEST_ELEMENT, f"'{file}'", "elements within each other")
                root = element
        return root
    except ElementTree.ParseError as error:
        raise DiffractionError(
            f"'{file}' is malformed XML ({error}); mend it, since Mitsuba may read it differently"
        ) from error
    except DiffractionError:
        raise
    except (OSError, ValueError) as error:
        raise _Unreadable from error


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
