"""`mitsuba-diffraction tonemap`: from the linear EXR of a picture to a PNG."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import DiffractionError
from ..scene import set_variant
from ..scene.pictures import read_exr, write_png
from . import options
from .report import Figures, output_of
from .values import STOPS, path_ending_in


@options.command(
    "tonemap", "show a linear EXR as a PNG",
    "Write a PNG of a picture that exists as a linear EXR, with another exposure or view "
    "than it was rendered with.",
    ("FILE.exr", "linear picture", Path, None, {"dest": "picture"}),
    ("-o --output OUT", "PNG to write; default: beside the EXR, with its name",
     path_ending_in(".png")),
    ("--exposure EV", "stops: +1 doubles the light", STOPS, 0.0),
    options.VIEW,
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Write the PNG, which has no figures."""
    if not args.picture.name:
        raise DiffractionError(f"'{args.picture}' is a folder; name a file in it")
    output = output_of(args, args.picture.with_suffix(".png"))
    set_variant("scalar_rgb")  # bitmaps belong to no variant, but Mitsuba asks for one
    write_png(read_exr(args.picture), output, args.exposure, args.view)
    print(f"{output}: view {args.view}, {args.exposure:+g} stops")
    return {}
