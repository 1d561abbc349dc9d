"""How a file is to be read and treated, checked once for Python, recipes and the command line."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass, fields, replace
from typing import Any

from ..errors import DiffractionError
from .lengths import Crop, Height, PixelSize, crop_of, height_of, height_unit_of, pixel_size_of
from .preprocess.missing import METHODS as FILLS

LEVELS = ("none", "plane", "lines")
PERIODICS = ("none", "smooth", "taper")


@dataclass(frozen=True)
class LoadOptions:
    """Parameters of `HeightField.load`, checked; `None` leaves a thing as the file has it.

    Made with `LoadOptions.of`, which raises a DiffractionError that names the parameter and the
    choices if a value does not fit.
    """

    pixel_size: tuple[float, float] | None = None
    max_height: float | None = None
    height_unit: str | None = None
    channel: str | int | None = None
    crop: tuple[float, float] | None = None
    fill: str | None = None
    level: str | None = None
    clip: float | None = None
    periodic: str | None = None

    @classmethod
    def of(
        cls,
        *,
        pixel_size: PixelSize | None = None,
        max_height: Height | None = None,
        height_unit: str | None = None,
        channel: str | int | None = None,
        crop: Crop | None = None,
        fill: str | None = None,
        level: str | None = None,
        clip: float | str | None = None,
        periodic: str | None = None,
    ) -> LoadOptions:
        """Check the values as users write them and settle their types."""
        if isinstance(channel, bool) or not isinstance(channel, (str, int, type(None))):
            raise DiffractionError(f"channel: expected a channel's name or index, got {channel!r}")
        return cls(
            pixel_size=pixel_size_of(pixel_size),
            max_height=height_of(max_height),
            height_unit=height_unit_of(height_unit),
            channel=channel,
            crop=crop_of(crop),
            fill=_choice(fill, "fill", ("none", *FILLS)),
            level=_choice(level, "level", LEVELS),
            clip=_sigmas(clip),
            periodic=_choice(periodic, "periodic", PERIODICS),
        )

    def updated(self, other: LoadOptions) -> LoadOptions:
        """These options, with those that `other` sets in their place."""
        given = {f.name: getattr(other, f.name) for f in fields(other)}
        return replace(self, **{name: value for name, value in given.items() if value is not None})

    def given(self) -> dict[str, Any]:
        """The options that were set, by name."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if value is not None}


def _choice(value: object, name: str, choices: tuple[str, ...]) -> str | None:
    if value is None:
        return None
    if not isinstance(value, str) or value not in choices:
        raise DiffractionError(
            f"{name}: expected one of {', '.join(map(repr, choices))}, got {value!r}"
        )
    return value


def _sigmas(value: object) -> float | None:
    """How many standard deviations to keep: a number or numeric string of at least 1."""
    if value is None or (isinstance(value, str) and value.strip() == "none"):
        return None
    try:
        if isinstance(value, bool) or not isinstance(value, (str, numbers.Real)):
            raise ValueError
        number = float(value)
        if not 1 <= number < math.inf:
            raise ValueError
    except (ValueError, OverflowError) as error:
        raise DiffractionError(
            f"clip: expected how many standard deviations to keep, at least 1, got {value!r}"
        ) from error
    return number
