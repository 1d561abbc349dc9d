"""Parameters of earlier versions: what names one goes on without it, with one line."""

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


def retired(names: Iterable[str], where: str = "") -> list[str]:
    """Return the retired ones of parameters' names, after a warning about each.

    where : the file that names them, for the warning.
    """
    found = [name for name in names if name in REPLACED]
    for name in found:
        place = f"{where}: " if where else ""
        warn(f"{place}{name} is no longer a parameter, and is ignored: {REPLACED[name]}")
    return found
