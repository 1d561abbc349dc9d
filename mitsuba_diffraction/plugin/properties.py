"""Words, flags and numbers from Mitsuba's Properties, refused by name where they are none."""

from __future__ import annotations

import math

from ..errors import DiffractionError
from .roles import BSDF, Properties


def choice(props: Properties, name: str, choices: tuple[str, ...]) -> str:
    """One of some words; the first is the default."""
    value = props.get(name, choices[0])
    if value not in choices:
        raise DiffractionError(f"{name}={value!r} is unknown; choose one of {', '.join(choices)}")
    return str(value)


def flag(props: Properties, name: str, default: bool) -> bool:
    """True or false."""
    value = props.get(name, default)
    if not isinstance(value, bool):
        raise DiffractionError(f"{name}={value!r} must be true or false")
    return value


def number(props: Properties, name: str, default: float) -> float:
    """A finite number."""
    if name not in props:
        return default
    value = props.get(name)
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise DiffractionError(f"{name}={value!r} must be a number") from None
    if not math.isfinite(found):
        raise DiffractionError(f"{name}={value} must be a finite number")
    return found


def kind_of(element: BSDF) -> str:
    """What an element of a scene is: `SmoothDielectric`, say."""
    return str(element.class_name())
