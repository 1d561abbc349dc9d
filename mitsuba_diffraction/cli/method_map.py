"""`brdf-map --method`: maps by the evaluators of `methods`, and the options that these take."""

from __future__ import annotations

import argparse
import time
import warnings
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, DiffractionWarning
from ..thesis.methods import NAMES as METHODS
from .patch import load_patch
from .progress import Bar

# What only the renderer's BSDF knows.
_OF_THE_BSDF = ("mode", "material", "orientation", "height_scale", "basis")


def add_method_options(group: argparse._ArgumentGroup) -> None:
    """Declare --method, --period and --relative."""
    group.add_argument(
        "--method", choices=METHODS,
        help="evaluate by a method of the source documents instead of the renderer's BSDF, or by "
        "the default's twin; R is 1, the light D65",
    )  # fmt: skip
    group.add_argument(
        "--period", metavar="D", type=float,
        help="µm, for the methods that need one; default: estimated from the heights",
    )  # fmt: skip
    group.add_argument(
        "--relative", action="store_true",
        help="the documents' relative reflectance instead of the BRDF, against a mirror of the "
        "same --int-ior (default: 1.5)",
    )  # fmt: skip


def refuse_contradictions(args: argparse.Namespace) -> None:
    """Usage errors: options that go with a method only, or never with one."""
    if args.method is None:
        for name in ("period", "relative"):
            if getattr(args, name):
                args.parser.error(f"argument --{name}: only with argument --method")
        return
    for name in _OF_THE_BSDF:
        if getattr(args, name) is not None:
            args.parser.error(
                f"argument --{name.replace('_', '-')}: not allowed with argument --method"
            )
    if args.spectral:
        args.parser.error("argument --spectral: not allowed with argument --method")
    if args.illuminant != "D65":
        args.parser.error("argument --method: is under --illuminant D65 only")
    if args.int_ior is not None and not args.relative:
        args.parser.error("argument --int-ior: with argument --method, only for --relative")


def gain_of(args: argparse.Namespace) -> Any:
    """The gain factor of --relative, or `None`.

    Raises
    ------
    DiffractionError
        If --int-ior is no number.
    """
    from ..thesis.methods import Gain

    if not args.relative:
        return None
    if args.int_ior is None:
        return Gain()
    try:
        index = float(args.int_ior)
    except ValueError as error:
        raise DiffractionError(
            f"int_ior='{args.int_ior}': relative reflectance takes a number, e.g. 1.5"
        ) from error
    return Gain(int_ior=index)


def run_method(args: argparse.Namespace, map_arguments: dict[str, Any], written: list[Path]) -> int:
    """Make the map and return the exit code.

    Parameters
    ----------
    map_arguments : wavelength_range, step and wavelength.
    written : EXR and PNG, or only the PNG.
    """
    from ..analysis.maps import Bands, Light, check_map, save_exr, save_png
    from ..thesis.methods import make
    from ..thesis.methods.maps import method_map

    start = time.perf_counter()
    light = Light(args.theta, args.phi)
    single = map_arguments["wavelength"]
    bands = Bands.of(map_arguments["wavelength_range"], map_arguments["step"], single)
    samples = 1 if args.samples is None else args.samples
    check_map(bands, args.resolution, samples, spectral=False)
    gain = gain_of(args)
    patch, settings = load_patch(args)
    settings["wavelength_range"] = map_arguments["wavelength_range"]
    if single is not None:
        settings["wavelength_range"] = (0.999 * single, 1.001 * single)
        settings["step"] = 0.001 * single
    else:
        settings["step"] = map_arguments["step"]
    with Bar(args) as bar, warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        method = make(args.method, patch, period=args.period, progress=bar, **settings)
        built = time.perf_counter()
        result = method_map(
            method, light, step=bands.width, wavelength=single, resolution=args.resolution,
            samples=samples, cosine=args.cosine, gain=gain, progress=bar,
        )  # fmt: skip
        seconds = time.perf_counter() - built
    quantity = "relative reflectance" if args.relative else "R = 1"
    surface = f"{quantity}; method {args.method}"
    exposure = None if bands.is_single else args.exposure
    if len(written) > 1:
        notes = {"source": str(args.source), "surface": surface, "method": args.method}
        save_exr(result, written[0], notes=notes)
    save_png(result, written[-1], exposure=exposure, title=args.source.name, notes=surface)
    print(
        f"{' and '.join(map(str, written))}: {args.resolution} x {args.resolution} pixels, "
        f"{samples} samples per pixel, {bands}, method {args.method}: {seconds:.2f} s for the map, "
        f"{time.perf_counter() - start:.1f} s in all"
    )
    return 0
