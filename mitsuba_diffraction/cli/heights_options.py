"""Options that say how a file of heights is read; the same wherever one is."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..heights.options import LoadOptions

_NAMES = ("pixel_size", "max_height", "channel", "crop", "fill", "level", "clip", "periodic")


def add_heights_options(parser: argparse.ArgumentParser) -> None:
    """Declare them; their values are checked by `load_options`."""
    group = parser.add_argument_group("reading heights")
    group.add_argument(
        "--pixel-size", metavar="DX[,DY]",
        help="µm between samples, where the file does not say",
    )  # fmt: skip
    group.add_argument("--max-height", metavar="H", help="µm, height of white in an image")
    group.add_argument(
        "--channel", metavar="C", help="name or index of the channel; default: the heights"
    )
    group.add_argument(
        "--crop", metavar="W[,H]", help="µm, keep the middle of the patch only; default: all of it"
    )
    group.add_argument(
        "--fill", metavar="METHOD",
        help="points without data: nearest or harmonic; default: refuse them",
    )  # fmt: skip
    group.add_argument(
        "--level", metavar="METHOD",
        help="plane: subtract the best plane; lines: align the scan lines, too; default: none",
    )  # fmt: skip
    group.add_argument(
        "--clip", metavar="N", help="cut heights beyond N robust standard deviations (dust)"
    )
    group.add_argument(
        "--periodic", metavar="METHOD",
        help="smooth or taper: make the patch fit itself at the seams; default: none",
    )  # fmt: skip


def load_options(args: argparse.Namespace) -> LoadOptions:
    """The options as `HeightField.load` takes them.

    Raises
    ------
    DiffractionError
        If a value does not fit.
    """
    from ..heights.options import LoadOptions

    return LoadOptions.of(**{name: getattr(args, name) for name in _NAMES})


def was_given(args: argparse.Namespace) -> list[str]:
    """Names of the options that stand on the command line."""
    return [f"--{name.replace('_', '-')}" for name in _NAMES if getattr(args, name) is not None]
