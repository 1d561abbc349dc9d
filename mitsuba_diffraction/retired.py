"""Retired parameters and retired values: they are ignored, with one line."""

from __future__ import annotations

from collections.abc import Iterable

from .errors import warn

#: What holds in place of each parameter.
REPLACED = {
    "second_order": "light is diffracted once",
    "layering": "a nested BSDF gets the light that is not reflected, T(ωi) T(ωo)",
    "diffuse_weight": "a nested BSDF gets the light that is not reflected, T(ωi) T(ωo)",
    "accept": "a table that misses its tolerance is written, with its measured error",
}
#: Replacements of a parameter's values.
REPLACED_VALUES = {
    ("periodic", value): "a scan is seen through windows, which need no treatment of its edges; "
    "periodic=exact states that it is whole periods of a surface"
    for value in ("trend", "smooth", "taper", "none")
}


def retired_value(name: str, value: object) -> bool:
    """Return whether a parameter's value is retired, after a warning about it."""
    replacement = REPLACED_VALUES.get((name, value)) if isinstance(value, str) else None
    if replacement is not None:
        warn(f"{name}={value} is no longer a treatment, and is ignored: {replacement}")
    return replacement is not None


def retired(names: Iterable[str], where: str = "") -> list[str]:
    """Return the retired ones of parameters' names, after a warning about each.

    where : the file that names them, for the warning.
    """
    found = [name for name in names if name in REPLACED]
    for name in found:
        place = f"{where}: " if where else ""
        warn(f"{place}{name} is no longer a parameter, and is ignored: {REPLACED[name]}")
    return found
