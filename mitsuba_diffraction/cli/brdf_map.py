"""`mitsuba-diffraction brdf-map`: the hemisphere of view directions for one light direction."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from ..optics.colour import ILLUMINANTS
from ..reference import COHERENCES
from .arguments import number_between, path_ending_in, whole_number
from .heights_options import add_heights_options, load_options, was_given
from .light_options import add_direction, add_wavelengths
from .method_map import add_method_options, refuse_contradictions, run_method
from .output import check_outputs
from .precompute import BASES
from .progress import Bar

_FULL_RANGE = (360.0, 830.0)
_STEP = 5.0
# Options that are parameters of the BSDF, by the plugin's own names.
_BSDF_NAMES = (
    "coherence_width", "coherence", "basis", "tolerance", "terms", "material", "int_ior",
    "orientation", "height_scale",
)  # fmt: skip


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "brdf-map",
        help="picture what a surface reflects in every direction",
        description=(
            "Picture the BRDF over all view directions for one light direction, seen from above: "
            "x = sin θ cos φ, y = sin θ sin φ, the normal in the middle. Writes linear numbers "
            "(EXR, 1/sr) and a picture with axes (PNG) beside them."
        ),
    )
    parser.add_argument(
        "source", metavar="SOURCE", type=Path,
        help="table, recipe (.toml), or heights of any format",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", metavar="OUT", type=path_ending_in(".exr", ".png"),
        help="EXR, with a PNG beside it, or only a PNG; default: SOURCE's name with -map.exr in "
        "the current folder",
    )  # fmt: skip
    parser.add_argument(
        "-m", "--mode", metavar="VARIANT",
        help="Mitsuba variant, spectral or RGB; default: cuda_ad_spectral with a GPU, else "
        "llvm_ad_spectral",
    )  # fmt: skip
    _add_map_options(parser.add_argument_group("the map"))
    _add_surface_options(parser.add_argument_group("the surface"))
    add_method_options(parser.add_argument_group("methods of the source documents"))
    add_heights_options(parser)
    parser.set_defaults(run=run, parser=parser)


def _add_map_options(group: argparse._ArgumentGroup) -> None:
    add_direction(group)
    add_wavelengths(group, *_FULL_RANGE, filled=False)
    group.add_argument(
        "--wavelength", metavar="NM", type=float, help="one wavelength only, in false colours"
    )
    group.add_argument(
        "--resolution", metavar="N", type=int, default=512, help="pixels a side; default: 512"
    )
    group.add_argument(
        "--samples", metavar="N", type=int,
        help="directions in a pixel; default: enough to find every lobe",
    )  # fmt: skip
    group.add_argument(
        "--illuminant", choices=ILLUMINANTS, default="D65",
        help="light for the colours, daylight or equal energy; default: D65",
    )  # fmt: skip
    group.add_argument(
        "--cosine", action="store_true", help="map f·cosθo, what a lit surface shows, instead of f"
    )
    group.add_argument(
        "--exposure", metavar="EV", type=number_between(-100, 100),
        help="of the PNG, in stops; default: half of the diffracted light is darker than white",
    )  # fmt: skip
    group.add_argument(
        "--spectral", action="store_true", help="every band as a channel of the EXR, too"
    )


def _add_surface_options(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--material", metavar="NAME",
        help="conductor, e.g. Al, or none for a reflectance of 1; default: none",
    )  # fmt: skip
    group.add_argument(
        "--int-ior", metavar="N", help="a dielectric of this index (or name) instead, e.g. 1.5"
    )
    group.add_argument("--orientation", metavar="DEG", type=float, help="turns the patch")
    group.add_argument(
        "--height-scale", metavar="S", type=number_between(1e-6, 1000), help="multiplies heights"
    )
    group.add_argument(
        "--coherence-width", metavar="W", type=float,
        help="µm, 4σ of the amplitude window; default: 65, or what table or recipe say",
    )  # fmt: skip
    group.add_argument("--coherence", choices=COHERENCES, help="default: ensemble, or likewise")
    group.add_argument("--basis", choices=BASES, help="series in κ; default: auto, or likewise")
    group.add_argument(
        "--tolerance", metavar="E", type=float, help="relative error; default: 1e-3, or likewise"
    )
    group.add_argument("--terms", metavar="N", type=whole_number(1), help="terms of the series")


def run(args: argparse.Namespace) -> int:
    """Make the map, and return the exit code."""
    start = time.perf_counter()
    _refuse_contradictions(args)
    output = args.output or Path(f"{args.source.stem}-map.exr")
    only_png = output.suffix.lower() == ".png"
    png = output if only_png else output.with_suffix(".png")
    if only_png and args.spectral:
        args.parser.error(f"argument --spectral: bands need an EXR, e.g. -o {output.stem}.exr")
    written = [png] if only_png else [output, png]
    check_outputs(written, [args.source], "map")
    load_options(args)  # what does not fit is said before Mitsuba is loaded
    if args.method is not None:
        return run_method(args, _map_arguments(args), written)

    from ..analysis.maps import Bands, Light, brdf_map, check_map, save_exr, save_png
    from ..scene.load import set_variant
    from .console import warnings_as_ours

    arguments = _map_arguments(args)
    light = Light(args.theta, args.phi)
    bands = Bands.of(arguments["wavelength_range"], arguments["step"], arguments["wavelength"])
    check_map(bands, args.resolution, args.samples, args.spectral)
    variant = set_variant(args.mode)

    with warnings_as_ours(), Bar(args) as bar:
        bsdf = _bsdf(args)
        result = brdf_map(
            bsdf, light.theta, light.phi, resolution=args.resolution, samples=args.samples,
            illuminant=args.illuminant, cosine=args.cosine, spectral=args.spectral, progress=bar,
            **arguments,
        )  # fmt: skip
    surface = _surface(bsdf)
    exposure = None if bands.is_single else args.exposure
    if not only_png:
        save_exr(result, output, notes={"source": str(args.source), "surface": surface})
    save_png(result, png, exposure=exposure, title=args.source.name, notes=surface)
    shown = ""
    if not bands.is_single:
        shown = f", exposure {result.exposure() if exposure is None else exposure:+g} stops"
    print(
        f"{' and '.join(map(str, written))}: {args.resolution} x {args.resolution} pixels, "
        f"{result.samples} samples per pixel, {bands}{shown}, {time.perf_counter() - start:.1f} s, "
        f"{variant}"
    )
    return 0


def _refuse_contradictions(args: argparse.Namespace) -> None:
    """Usage errors that argparse does not find by itself."""
    if args.wavelength is not None:
        for name in ("wavelength_range", "step", "exposure"):
            if getattr(args, name) is not None:
                option = f"--{name.replace('_', '-')}"
                args.parser.error(f"argument --wavelength: not allowed with argument {option}")
        if args.spectral:
            args.parser.error("argument --wavelength: not allowed with argument --spectral")
    if args.material is not None and args.int_ior is not None:
        args.parser.error("argument --int-ior: not allowed with argument --material")
    refuse_contradictions(args)


def _map_arguments(args: argparse.Namespace) -> dict[str, Any]:
    return {
        "wavelength_range": tuple(args.wavelength_range or _FULL_RANGE),
        "step": _STEP if args.step is None else args.step,
        "wavelength": args.wavelength,
    }


def _bsdf(args: argparse.Namespace) -> Any:
    """The plugin for what the command line says, in the variant that is set."""
    import mitsuba as mi

    from ..plugin.bsdf import Diffraction

    parameters = {
        name: getattr(args, name) for name in _BSDF_NAMES if getattr(args, name) is not None
    }
    for option in was_given(args):
        name = option.removeprefix("--").replace("-", "_")
        parameters[name] = getattr(args, name)
    if "int_ior" not in parameters:
        parameters.setdefault("material", "none")
    elif _is_number(parameters["int_ior"]):
        parameters["int_ior"] = float(parameters["int_ior"])
    props = mi.Properties("diffraction")
    for name, value in {"heightfield": str(args.source), **parameters}.items():
        props[name] = value
    return Diffraction(props)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _surface(bsdf: Any) -> str:
    """What reflects, in a line."""
    table, scale, turn = bsdf.table, bsdf.height_scale[0], bsdf.orientation.degrees[0]
    return "; ".join(
        [
            "R = 1" if str(bsdf.fresnel) == "none" else str(bsdf.fresnel),
            f"{table.coherence}, coherence width {table.coherence_width:g} µm",
            *([f"heights × {scale:g}"] if scale != 1.0 else []),
            *([f"turned by {turn:g}°"] if turn != 0.0 else []),
        ]
    )
