"""`mitsuba-diffraction render --observer`: a picture as an animal's receptors catch it."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..errors import DiffractionError
from ..scene.load import load_scene, set_variant
from ..scene.pictures import count_bad, write_exr
from . import scene_options
from .console import mitsuba_warnings, say, say_warning
from .report import Figures, check_outputs, default_output, elapsed, output_name, save_figure

#: The animal.
OBSERVER = (
    ("--observer ANIMAL|CSV", "an eye, as in `spectrum`: the EXR has a channel for each receptor, "
     "the PNG is in false colour with a legend; tables of heights then serve ultraviolet"),
    ("--illuminant LIGHT|CSV", "with --observer: light of the scene in place of daylight, D65, "
     "e.g. leaves, shade under leaves; as in `spectrum`"),
)  # fmt: skip


def run_observed(args: argparse.Namespace) -> Figures:
    """Render with a band for each receptor, and return the figures."""
    from ..analysis.observers import GRID, eye_of, relit, responses

    if args.frames is not None or args.plan is not None or args.denoise or args.workers:
        args.parser.error("argument --observer: is for one picture in one process, without a plan")
    eye = eye_of(args.observer)
    seen = responses(eye) * relit(args.illuminant or "d65")
    parameters = scene_options.scene_parameters(args)

    def files(exr: Path) -> list[Path]:
        return [exr, exr.with_suffix(".png")]

    output = output_name(args.output, Path(default_output(args.name, ".exr").name), files)
    if output.suffix.lower() != ".exr":
        args.parser.error(f"argument -o: --observer writes an EXR, not {str(output)!r}")
    output, png = files(output)
    check_outputs([output, png])
    variant = set_variant(args.mode)
    if "_spectral" not in variant:
        raise DiffractionError(f"variant {variant}: an eye needs a spectral one; leave --mode out")
    from ..scene.bands import SensorBands

    bands = SensorBands(GRID.tolist(), dict(zip(eye.names, seen.tolist(), strict=True)))
    with mitsuba_warnings():
        result = scene_options.rendered(
            args,
            variant,
            lambda _: load_scene(args.scene, parameters, bands=bands, say=say),
            lambda *_: check_outputs([output, png]),  # of what only loading tells
        )[2]
    if bad := count_bad(result.bitmap):
        say_warning(f"{bad} pixels are not finite (NaN or infinite); they are black in the PNG")
    channels = np.nan_to_num(np.array(result.bitmap, np.float64)[..., : len(eye.names)])
    dark = [n for n, total in zip(eye.names, channels.sum(axis=(0, 1)), strict=True) if not total]
    if dark:
        say(f"receptors without light: {', '.join(dark)}: lights of colours and d65 begin at 360 "
            "nm, sunsky at 320 nm; give spectra that reach further")  # fmt: skip
    write_exr(
        result.bitmap, output,
        {"scene": str(args.scene), "variant": variant, "seed": args.seed, "spp": result.spp,
         "observer": args.observer, "illuminant": args.illuminant or "of the scene"},
    )  # fmt: skip
    from ..analysis.false_colour import false_colour_figure

    light = f", light: {Path(args.illuminant).stem}" if args.illuminant else ""
    title = f"{args.name.name} as {Path(args.observer).stem}{light}"
    save_figure(png, false_colour_figure(channels, eye, args.exposure, title))
    width, height = result.bitmap.size()
    print(
        f"{output} and {png}: {width} x {height} pixels, channels {', '.join(eye.names)}, "
        f"{result.spp} samples per pixel, {elapsed(args):.1f} s, {variant}"
    )
    return {
        "scene": args.scene, "files": [output, png], "observer": args.observer,
        "receptors": list(eye.names), "spp": result.spp,
    }  # fmt: skip
