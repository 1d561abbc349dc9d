"""Words, flags and numbers from Mitsuba's Properties, refused by name; what elements are called."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, check_choice
from .types import BSDF, Properties


def choice(props: Properties, name: str, choices: tuple[str, ...]) -> str:
    """Read a word out of several; the first is the default."""
    value = props.get(name, choices[0])
    check_choice(name, value, choices)
    return str(value)


def flag(props: Properties, name: str, default: bool) -> bool:
    """Read a boolean."""
    value = props.get(name, default)
    if not isinstance(value, bool):
        raise DiffractionError(f"{name}={value!r} must be true or false")
    return value


def number(props: Properties, name: str, default: float) -> float:
    """Read a finite number."""
    if name not in props:
        return default
    value = props.get(name)
    try:
        parsed = float(value)
    except (TypeError, ValueError):
        raise DiffractionError(f"{name}={value!r} must be a number") from None
    if not math.isfinite(parsed):
        raise DiffractionError(f"{name}={value} must be a finite number")
    return parsed


def class_of(element: BSDF) -> str:
    """Return the class of an element of a scene, for example `SmoothDielectric`."""
    return str(element.class_name())


#: What Mitsuba's parser gives to elements without an id, numbered.
_UNNAMED = "_unnamed"
# Meshes print the name of their file, plugins that were not given one nothing.
_FILE = re.compile(r'\w*Mesh\[\s*name = "([^"]+)"')


def name_of(element: Any, number: int | None = None) -> str:
    """An element's id; else its mesh's file, or its kind, and which of the scene's shapes it is.

    Parameters
    ----------
    element : of Mitsuba's, with `id()`.
    number : of a shape, its place in `scene.shapes()`, counted from 0.
    """
    scene_id = own_id(element.id())
    if scene_id:
        return scene_id
    file = _FILE.match(str(element))
    if file:
        kind = f"the mesh {Path(file[1]).name}"
    else:
        kind = f"{_with_article(element.class_name())} without id"
    return kind if number is None else f"shape {number + 1} ({kind})"


def own_id(name: str) -> str:
    """Return the id that the scene gives, empty if Mitsuba made it up."""
    return "" if name.startswith(_UNNAMED) else name


def _with_article(kind: str) -> str:
    """`AreaLight` as "an area light"."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind).lower()
    return f"{'an' if words[:1] in 'aeiou' else 'a'} {words}"
