"""`mitsuba-diffraction presets`: the named looks that --preset takes."""

from __future__ import annotations

import argparse

from . import options
from .report import save_report


def add_parser(subparsers: options.Subparsers) -> None:
    parser = options.add_command(
        subparsers, "presets", run, "list the named looks",
        "List the named looks, which --preset takes in place of a patch: docs/presets.md.",
    )  # fmt: skip
    options.add_json(parser, "the looks")


def run(args: argparse.Namespace) -> int:
    """Print a line for each look, and return the exit code."""
    from ..plugin.presets import presets

    width = max(map(len, presets()))
    for preset in presets().values():
        print(f"{preset.name:{width}}  {preset.about}")
    save_report(args, {
        "presets": [
            {"name": preset.name, "about": preset.about, **preset.changed({})}
            for preset in presets().values()
        ]
    })  # fmt: skip
    return 0
