"""What messages call an element of a scene, with an id or without."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

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
    own = own_id(element.id())
    if own:
        return own
    file = _FILE.match(str(element))
    if file:
        kind = f"the mesh {Path(file[1]).name}"
    else:
        kind = f"{_with_article(element.class_name())} without id"
    return kind if number is None else f"shape {number + 1} ({kind})"


def own_id(given: str) -> str:
    """An id as the scene gives it, empty where it was made up."""
    return "" if given.startswith(_UNNAMED) else given


def _with_article(kind: str) -> str:
    """`AreaLight` as "an area light"."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind).lower()
    return f"{'an' if words[:1] in 'aeiou' else 'a'} {words}"
