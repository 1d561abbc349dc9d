"""What the programs of this folder share: a measured patch, measurements, errors in one line."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.field import HeightField

Made = TypeVar("Made")

#: What the command line calls a method that the library has under another name.
SHOWN = {"default": "spectral"}


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


def add_pages(parser: argparse.ArgumentParser, *defaults: str) -> None:
    """Declare -o, the pages that are updated."""
    parser.add_argument(
        "-o", "--output", metavar="FILE", type=Path, nargs="+", default=[Path(p) for p in defaults],
        help=f"pages, each with some of the markers; default: {' '.join(defaults)}",
    )  # fmt: skip


def from_json(file: Path, make: Callable[[Any], Made], *, writer: str, remedy: str) -> Made:
    """What `make` makes of a measurement in JSON.

    Parameters
    ----------
    make : takes the document; what it misses there shows that this is another file.
    writer, remedy : the command that writes such files, and what to do if this is none.

    Raises
    ------
    DiffractionError
        If the file is missing or something else.
    """
    try:
        return make(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, LookupError, TypeError, StopIteration) as error:
        raise DiffractionError(
            f"'{file}' is not what {writer} writes ({error}); {remedy}"
        ) from error


def exit_code(name: str, work: Callable[[], None]) -> int:
    """Run `work`; 0, or 1 after an error, which is printed in one line."""
    try:
        work()
    except DiffractionError as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 1
    return 0
