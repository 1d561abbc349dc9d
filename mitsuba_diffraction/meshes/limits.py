"""One check for the parameters of the generators."""

from __future__ import annotations

from ..errors import DiffractionError


def check_limits(owner: object, limits: dict[str, tuple[float, float]]) -> None:
    """Refuse attributes of `owner` outside their limits (or NaN), naming the first such one.

    Raises
    ------
    DiffractionError
        With the parameter, its value and the limits.
    """
    for name, (low, high) in limits.items():
        value = getattr(owner, name)
        if not low <= value <= high:
            raise DiffractionError(f"snake: {name} = {value:g} is outside {low:g} to {high:g}")
