"""All pictures of the documentation with one command.

    python -m docs.make.figures -o docs/images \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from . import maps, patches, snakes
from .program import add_measured


def main(argv: Sequence[str] | None = None) -> int:
    """Make the pictures that are asked for, and return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.make.figures",
        description="Make the pictures of the documentation: patches, BRDF maps, snakes.",
    )
    parser.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs/images"))
    parser.add_argument(
        "--only", metavar="NAME", action="append", choices=tuple(FIGURES),
        help=f"one of {', '.join(FIGURES)}; may be given several times",
    )  # fmt: skip
    add_measured(parser, "height field to compare with")
    parser.add_argument("--scenes", metavar="FOLDER", default="scenes")
    parser.add_argument("-s", "--spp", metavar="N", default="64", help="samples of renderings")
    args = parser.parse_args(argv)
    args.output.mkdir(parents=True, exist_ok=True)
    for name in args.only or FIGURES:
        start = time.perf_counter()
        code = FIGURES[name](args)
        if code != 0:
            return code
        print(f"{name}: {time.perf_counter() - start:.1f} s")
    return 0


def _patches(args: argparse.Namespace) -> int:
    return patches.main(["-o", str(args.output / "patches.png"), *_measured(args)])


def _maps(args: argparse.Namespace) -> int:
    return maps.main(["-o", str(args.output / "maps.png"), *_measured(args)])


def _snakes(args: argparse.Namespace) -> int:
    return snakes.main(["-o", str(args.output), "--scenes", args.scenes, "-s", args.spp])


def _measured(args: argparse.Namespace) -> list[str]:
    """The options that name a measured patch, as the single figures take them."""
    given = {
        "--measured": args.measured,
        "--pixel-size": args.pixel_size,
        "--max-height": args.max_height,
    }
    return [part for option, value in given.items() if value for part in (option, value)]


#: The figures by name, in the order in which they are made.
FIGURES: dict[str, Callable[[argparse.Namespace], int]] = {
    "patches": _patches,
    "maps": _maps,
    "snakes": _snakes,
}


if __name__ == "__main__":
    sys.exit(main())
