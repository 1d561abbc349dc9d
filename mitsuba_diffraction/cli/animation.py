"""Options of an animation, and reasons to render frames again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..scene.frames import MISSING
from ..scene.parameters import change_of
from .console import say
from .values import number_between, value, whole_number

#: The number of frames and the parameters that change.
ANIMATION = (
    ("--frames N", "render N pictures, frame_0000.png", whole_number(1)),
    ("--animate KEY=FROM:TO", "parameter that changes from the first frame to the last, e.g. "
     "sun_elevation=10:60 or camera=0,-9,3:4,-9,3; may be given several times",
     [value("KEY=FROM:TO", change_of)]),
    ("--turn KEY", "angle of the scene, degrees, that turns once around, e.g. sun_azimuth; may be "
     "given several times", [str]),
    ("--exr", "write a linear EXR of each frame, too", bool),
    ("--fps N", "frames a second", number_between(1, 100), 24.0),
)  # fmt: skip


def say_why(reasons: Mapping[Path, tuple[str, str] | None]) -> None:
    """Print how many frames are kept, and why others are rendered again."""
    again: dict[str, list[str]] = {}
    for path, reason in reasons.items():
        if reason is not None and reason != MISSING:
            again.setdefault(reason[0], []).append(f"{path.name} {reason[1]}")
    for name, frames in again.items():
        say(
            f"{len(frames)} of {len(reasons)} frames are rendered again because of their {name}: "
            f"of {frames[0]}"
        )
    kept = sum(reason is None for reason in reasons.values())
    if kept:
        say(f"{kept} of {len(reasons)} frames are up to date")
