"""Options of an animation, and reasons to render frames again."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from ..scene.frames import MISSING
from . import scene_options
from .console import say
from .options import number_between, whole_number


def add_animation(parser: argparse.ArgumentParser) -> None:
    """Declare the number of frames and the parameters that change."""
    film = parser.add_argument_group("animation")
    count = whole_number(1)
    film.add_argument("--frames", metavar="N", type=count, help="render N pictures, frame_0000.png")
    film.add_argument(
        "--animate", metavar="KEY=FROM:TO", type=scene_options.change, action="append", default=[],
        help="change a parameter of the scene from the first frame to the last, e.g. "
        "sun_elevation=10:60, or lists: camera=0,-9,3:4,-9,3; may be given several times",
    )  # fmt: skip
    film.add_argument(
        "--turn", metavar="KEY", action="append", default=[],
        help="turn an angle of the scene, in degrees, once around from its value on, e.g. "
        "sun_azimuth for the light or turn for the snake; may be given several times",
    )  # fmt: skip
    film.add_argument("--exr", action="store_true", help="write a linear EXR of each frame, too")
    fps = number_between(1, 100)
    film.add_argument("--fps", metavar="N", type=fps, help="frames a second; default: 24")


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
