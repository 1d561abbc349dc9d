"""Which parameters of a scene change from frame to frame, and to what."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import DiffractionError, quoted
from .parameters import parameters_of

Numbers = tuple[float, ...]


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

    Raises
    ------
    DiffractionError
        If it is none.
    """
    name, equals, values = text.partition("=")
    start, colon, end = values.partition(":")
    if not (name and equals and colon):
        raise DiffractionError(f"expected KEY=FROM:TO, e.g. sun_azimuth=0:90, got {quoted(text)}")
    pair = numbers_in(start), numbers_in(end)
    if pair[0] is None or pair[1] is None or len(pair[0]) != len(pair[1]):
        raise DiffractionError(
            f"expected numbers, as many before as after the colon, got {quoted(text)}"
        )
    return Change(name, pair[0], pair[1])


def numbers_in(text: str) -> Numbers | None:
    """The finite numbers of a list with commas between, or None if it is none."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    return values if all(map(math.isfinite, values)) else None


def values_of_frames(
    scene: Path,
    given: Mapping[str, str],
    count: int,
    changes: Sequence[Change],
    turns: Sequence[str],
) -> list[dict[str, str]]:
    """Parameters of the scene for each of `count` frames.

    Parameters
    ----------
    scene : XML file.
    given : parameters that stay.
    changes : from the first frame to the last, both ends included.
    turns : names of angles in degrees that turn once around, beginning where the scene has them;
        the last frame is one step before the first, so that a film of them closes.

    Raises
    ------
    DiffractionError
        If an angle to be turned has no value to begin with, or one that is no number.
    """
    around = []
    for name in turns:
        start = given.get(name) or (parameters_of(scene, given) or {}).get(name, "0")
        begin = numbers_in(start or "")
        if begin is None or len(begin) != 1:
            raise DiffractionError(
                f"--turn {name}: it begins at {start!r}, which is no angle in degrees; give a "
                f"number: -D {name}=0"
            )
        around.append(Change(name, begin, (begin[0] + 360.0,)))
    frames = []
    for n in range(count):
        values = dict(given)
        values |= {one.name: one.at(n / max(1, count - 1)) for one in changes}
        values |= {one.name: one.at(n / count) for one in around}
        frames.append(values)
    return frames
