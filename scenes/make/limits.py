"""Check of the parameters of the generators."""

from __future__ import annotations

from collections.abc import Mapping

from mitsuba_diffraction.errors import DiffractionError


def check_limits(
    owner: object, limits: dict[str, tuple[float, float]], what: str = "snake"
) -> None:
    """Refuse values outside their limits (or NaN), naming the first such one.

    Parameters
    ----------
    owner : has the values, as attributes or as a mapping.
    limits : lowest and highest by name.
    what : what they describe, the error's first word.

    Raises
    ------
    DiffractionError
        With the parameter, its value and the limits.
    """
    for name, (low, high) in limits.items():
        value = owner[name] if isinstance(owner, Mapping) else getattr(owner, name)
        if not low <= value <= high:
            raise DiffractionError(f"{what}: {name} = {value:g} is outside {low:g} to {high:g}")
