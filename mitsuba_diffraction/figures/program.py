"""What the programs of this folder have in common: a measured patch, and errors in one line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from ..errors import DiffractionError
from ..heightfield import HeightField


def add_measured(parser: argparse.ArgumentParser, what: str) -> None:
    """Declare the options that name a measured patch; `what` says what becomes of it."""
    parser.add_argument("--measured", metavar="FILE", help=what)
    parser.add_argument("--pixel-size", metavar="DX", help="of the measured patch, µm")
    parser.add_argument("--max-height", metavar="H", help="of the measured patch, µm")


def measured_patch(args: argparse.Namespace) -> HeightField | None:
    """The patch that these options name, or None.

    Raises
    ------
    DiffractionError
        If it cannot be read.
    """
    if args.measured is None:
        return None
    return HeightField.load(args.measured, pixel_size=args.pixel_size, max_height=args.max_height)


def exit_code(name: str, work: Callable[[], None]) -> int:
    """Run `work`; 0, or 1 after an error, which is printed in one line."""
    try:
        work()
    except DiffractionError as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 1
    return 0
