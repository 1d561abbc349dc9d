"""`mitsuba-diffraction render --observer`: a picture as an animal's receptors catch it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis import observers
from ..analysis.false_colour import false_colour_figure
from ..analysis.observers import Eye
from ..errors import DiffractionError
from ..images import save_figure
from ..scene.bands import SensorBands
from ..scene.pictures import write_exr
from . import options
from .console import say

#: The animal.
OBSERVER = (
    ("--observer ANIMAL|CSV", "an eye, as in `spectrum`: the EXR has a channel for each receptor, "
     "the PNG is in false colour with a legend; tables of heights then serve ultraviolet"),
    ("--illuminant LIGHT|CSV", "with --observer: light of the scene in place of daylight, D65, "
     "e.g. leaves, shade under leaves; as in `spectrum`"),
)  # fmt: skip


def eye_of(args: argparse.Namespace) -> Eye | None:
    """Return the eye of --observer, or None; options that it excludes are a usage error."""
    if args.observer is None:
        options.refuse(args, ["illuminant"], ": is for the eye of --observer; name one")
        return None
    if args.frames is not None or args.plan is not None or args.denoise or args.workers:
        args.parser.error("argument --observer: is for one picture in one process, without a plan")
    options.refuse(
        args, ["view"], ": has no effect on the false colours of --observer; leave it out"
    )
    if args.output is not None and args.output.suffix.lower() != ".exr":
        args.parser.error(f"argument -o: --observer writes an EXR, not {str(args.output)!r}")
    return observers.eye_of(args.observer)


def bands_of(args: argparse.Namespace, eye: Eye, variant: str) -> Any:
    """Return the bands of the film, one for each receptor, in the variant that is set.

    Raises a DiffractionError if the variant has no wavelengths, or the light is unknown.
    """
    if "_spectral" not in variant:
        raise DiffractionError(f"variant {variant}: an eye needs a spectral one; leave --mode out")
    seen = observers.responses(eye) * observers.relit(args.illuminant or "d65")
    return SensorBands(observers.GRID.tolist(), dict(zip(eye.names, seen.tolist(), strict=True)))


def save_observed(
    args: argparse.Namespace, eye: Eye, picture: Any, exr: Path, origin: Mapping[str, str | int]
) -> list[Path]:
    """Write the channels, and the picture in false colour beside them; return the files."""
    channels = np.nan_to_num(np.array(picture, np.float64)[..., : len(eye.names)])
    dark = [n for n, total in zip(eye.names, channels.sum(axis=(0, 1)), strict=True) if not total]
    if dark:
        say(f"receptors without light: {', '.join(dark)}: lights of colours and d65 begin at 360 "
            "nm, sunsky at 320 nm; give spectra that reach further")  # fmt: skip
    seen = {"observer": args.observer, "illuminant": args.illuminant or "of the scene"}
    write_exr(picture, exr, {"scene": str(args.scene), **origin, **seen})
    light = f", light: {Path(args.illuminant).stem}" if args.illuminant else ""
    title = f"{args.name.name} as {Path(args.observer).stem}{light}"
    png = exr.with_suffix(".png")
    save_figure(png, false_colour_figure(channels, eye, args.exposure, title))
    return [exr, png]
