"""`mitsuba-diffraction presets`: the presets that --preset takes."""

from __future__ import annotations

import argparse

from ..plugin.presets import presets
from . import options
from .report import Figures


@options.command(
    "presets", "list the presets",
    "List the presets, which --preset uses in place of a patch: docs/gallery.md.",
    options.json("the looks"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Print a line for each look, and return the figures."""
    width = max(map(len, presets()))
    for preset in presets().values():
        print(f"{preset.name:{width}}  {preset.about}")
    return {
        "presets": [
            {"name": preset.name, "about": preset.about, **preset.changed({})}
            for preset in presets().values()
        ]
    }  # fmt: skip
