"""What commands that take a scene have in common: the scene, its parameters, variant and sensor."""

from __future__ import annotations

import argparse
from pathlib import Path

from .arguments import definition, whole_number


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """Declare SCENE, -m, -D and --sensor."""
    parser.add_argument("scene", metavar="SCENE", type=Path, help="Mitsuba XML file")
    parser.add_argument(
        "-m", "--mode", metavar="VARIANT",
        help="Mitsuba variant; default: cuda_ad_spectral with a GPU, else llvm_ad_spectral",
    )  # fmt: skip
    parser.add_argument(
        "-D", "--define", metavar="KEY=VALUE", type=definition, action="append", default=[],
        dest="parameters", help="set a parameter of the scene; may be given several times",
    )  # fmt: skip
    parser.add_argument(
        "--sensor", metavar="N", type=whole_number(0), default=0,
        help="which sensor, counted from 0; default: 0",
    )  # fmt: skip


def scene_parameters(args: argparse.Namespace) -> dict[str, str]:
    """The values of -D; one that is given twice is a usage error."""
    parameters = dict(args.parameters)
    if len(parameters) < len(args.parameters):
        twice = next(k for k in parameters if [n for n, _ in args.parameters].count(k) > 1)
        args.parser.error(f"argument -D: {twice!r} is set more than once")
    return parameters
