"""`mitsuba-diffraction presets`: the presets that --preset takes."""

from __future__ import annotations

import argparse

from . import options
from .report import Figures


def add_parser(subparsers: options.Subparsers) -> None:
    parser = options.add_command(
        subparsers, "presets", run, "list the presets",
        "List the presets, which --preset uses in place of a patch: docs/gallery.md.",
    )  # fmt: skip
    options.add_json(parser, "the looks")


def run(args: argparse.Namespace) -> Figures:
    """Print a line for each look, and return the figures."""
    from ..plugin.presets import presets

    width = max(map(len, presets()))
    for preset in presets().values():
        print(f"{preset.name:{width}}  {preset.about}")
    return {
        "presets": [
            {"name": preset.name, "about": preset.about, **preset.changed({})}
            for preset in presets().values()
        ]
    }  # fmt: skip
