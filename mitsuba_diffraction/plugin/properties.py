"""Words, flags, numbers and files from Mitsuba's Properties, refused by name."""

from __future__ import annotations

import math
from pathlib import Path

import mitsuba as mi

from ..errors import DiffractionError, check_choice
from ..settings import COHERENCES, SURFACE
from .types import BSDF, Properties


def choice(props: Properties, name: str, choices: tuple[str, ...]) -> str:
    """Read a word out of several; the first is the default."""
    value = props.get(name, choices[0])
    check_choice(name, value, choices)
    return str(value)


def coherence_of(props: Properties) -> str:
    """Return the coherence that a scene asks for."""
    return choice(props, "coherence", (*COHERENCES, SURFACE))


def flag(props: Properties, name: str, default: bool) -> bool:
    """Read a boolean."""
    value = props.get(name, default)
    if not isinstance(value, bool):
        raise DiffractionError(f"{name}={value!r} must be true or false")
    return value


def number(props: Properties, name: str, default: float, advice: str = "") -> float:
    """Read a finite number; `advice` ends the message on a texture or word instead."""
    if name not in props:
        return default
    value = props.get(name)
    try:
        parsed = float(value)
    except (TypeError, ValueError):
        shown = class_of(value) if isinstance(value, mi.Object) else repr(value)
        raise DiffractionError(f"{name}={shown} must be a number{advice}") from None
    if not math.isfinite(parsed):
        raise DiffractionError(f"{name}={value} must be a finite number")
    return parsed


def class_of(element: BSDF) -> str:
    """Return the class of an element of a scene, for example `SmoothDielectric`."""
    return str(element.class_name())


def resolved_path(name: str, parameter: str) -> Path:
    """Return the file of this name: as it is, or in a folder where Mitsuba looks for files.

    Raises a DiffractionError if the file is missing, with the folders.
    """
    if not name:  # the first folder
        raise DiffractionError(f"{parameter} is empty; name a file")
    resolver = mi.file_resolver()
    path = Path(str(resolver.resolve(name)))
    if path.exists() or path.is_absolute():
        return path  # its reader says that the file does not exist
    folders = dict.fromkeys(str(Path(str(folder)).resolve()) for folder in resolver)
    looked = ", ".join(repr(folder) for folder in folders)
    raise DiffractionError(
        f"{parameter}: '{name}' does not exist; looked for it in {looked}; give its whole path, "
        "or put it there"
    )
