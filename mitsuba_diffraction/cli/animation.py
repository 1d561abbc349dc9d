"""Options of an animation, and reasons to render frames again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from ..scene.frames import MISSING
from . import scene_options
from .console import say
from .options import number_between, whole_number

#: The number of frames and the parameters that change.
ANIMATION = (
    ("--frames N", "render N pictures, frame_0000.png", whole_number(1)),
    ("--animate KEY=FROM:TO", "parameter that changes from the first frame to the last, e.g. "
     "sun_elevation=10:60 or camera=0,-9,3:4,-9,3; may be given several times",
     [scene_options.change]),
    ("--turn KEY", "angle of the scene, degrees, that turns once around, e.g. sun_azimuth; may be "
     "given several times", [str]),
    ("--exr", "write a linear EXR of each frame, too", bool),
    ("--fps N", "frames a second", number_between(1, 100), 24.0),
)  # fmt: skip


def say_why(reasons: Mapping[Path, tuple[str, str] | None]) -> None:
    """Print how many frames are kept, and why others are rendered again."""
    examples: dict[str, tuple[Path, str]] = {}
    again: Counter[str] = Counter()
    for path, reason in reasons.items():
        if reason is not None and reason != MISSING:
            again[reason[0]] += 1
            examples.setdefault(reason[0], (path, reason[1]))
    for name, number in again.items():
        path, example = examples[name]
        say(
            f"{number} of {len(reasons)} frames are rendered again because of their {name}: of "
            f"{path.name} {example}"
        )
    kept = sum(reason is None for reason in reasons.values())
    if kept:
        say(f"{kept} of {len(reasons)} frames are up to date")
