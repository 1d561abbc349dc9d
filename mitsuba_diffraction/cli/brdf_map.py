"""`mitsuba-diffraction brdf-map`: the hemisphere of view directions for one light direction."""

from __future__ import annotations

import argparse
import time
import warnings
from pathlib import Path
from typing import Any

from ..analysis.maps import (
    Bands,
    LightDirection,
    brdf_map,
    check_map,
    check_variant,
    save_exr,
    save_png,
)
from ..analysis.media import medium_index
from ..analysis.scans import bsdf_of, check_surface
from ..errors import DiffractionError, DiffractionWarning, counted
from ..files import FileKind, kind_of, readable_file
from ..optics.boundary import MODELS
from ..optics.colour import ILLUMINANTS
from ..optics.materials import TISSUES
from ..plugin.description import Surface
from ..plugin.dictionary import bsdf_dict
from ..plugin.pigment import pigment_range
from ..plugin.presets import find_preset, preset
from ..scene import set_variant
from ..settings import TableSettings
from ..thesis.methods import Gain, make, method_map
from . import options
from .console import Bar, say_warning
from .report import Figures, elapsed, exr_and_png, output_of
from .values import STOPS, number_between, path_ending_in

_KEPT = "that of the table or recipe, else "
_TABLE = {
    "coherence_width": f"{_KEPT}auto", "coherence": f"{_KEPT}ensemble", "basis": f"{_KEPT}auto",
    "tolerance": f"{_KEPT}1e-3", "terms": "as many as the tolerance needs",
}  # fmt: skip
# Options that are parameters of the BSDF, by the plugin's own names.
_SURFACE = (
    "material", "int_ior", "ext_ior", "coat_ior", "layers", "pigment", "model", "orientation",
    "height_scale",
)  # fmt: skip
#: Options of a surface that a table of solved orders has in itself.
OF_ORDERS = (
    *(name for name in _SURFACE if name != "orientation"),
    *(name for name in _TABLE if name != "coherence_width"), *options.HEIGHTS,
)  # fmt: skip
# Options that only the renderer's BSDF has; methods are in daylight.
_OF_THE_BSDF = (
    "mode", *(name for name in _SURFACE if name != "int_ior"), "basis", "preset", "spectral",
    "illuminant",
)  # fmt: skip


#: SOURCE or --preset; see `take_source`.
SURFACE_SOURCE = (
    ("SOURCE", "table, recipe (.toml), or heights of any format", Path, None, {"nargs": "?"}),
    ("--preset NAME", "instead of SOURCE: a preset, which 'mitsuba-diffraction presets' lists; "
     "options of the surface change it"),
)  # fmt: skip
#: Options of a surface's material and layers, by the plugin's names.
MATERIAL = (
    ("--material MATERIAL", f"{', '.join(TISSUES)}; index, 1.56 or 1.56+0.05i; conductor, gold; or "
     "none (R = 1); default: --int-ior"),
    ("--int-ior N", "index of the dielectric at all wavelengths, or its name; default: 1.5, as in "
     "scenes"),
    ("--ext-ior N", "refractive index of the surrounding medium, or its name: water for an animal "
     "under water (at 589 nm; in spectrum at each wavelength); default: air"),
    ("--coat-ior N", "index of a flat clear coat over the surface, or its name: water on a wet "
     "animal"),
    ("--layers TOML", "stack of thin layers on the surface; parameter layers in "
     "docs/parameters.md"),
    ("--pigment COLOUR|CSV", "diffuse pigment beneath a clear material: grey, 'r,g,b', sienna, or "
     "a file of wavelengths (nm) and reflectances; default: none"),
)  # fmt: skip
#: See `gain_of`.
RELATIVE = (
    "--relative", "the thesis' relative reflectance instead of the BRDF, against a mirror of the "
    "same --int-ior (default: 1.5)", bool,
)  # fmt: skip


def surface_options(*, turned: bool = True) -> options.Group:
    """Return the options of a reflecting surface; see `surface_bsdf`.

    turned: include its orientation.
    """
    model = "model of the boundary; default: small_slope for materials with an index"
    return options.Group("the surface", (
        *MATERIAL,
        ("--model", model, tuple(MODELS)),
        *([("--orientation DEG", "angle of the patch", float)] if turned else []),
        ("--height-scale S", "factor on the heights", number_between(1e-6, 1000)),
        *options.table(tuple(_TABLE), **_TABLE),
        options.retired_row("second_order"),
    ))  # fmt: skip


def take_source(args: argparse.Namespace) -> None:
    """Set `args.source` to the patch of --preset, and refuse contradictory materials.

    Raises a DiffractionError if no preset has the name, the pigment is a picture, or an option for
    reading heights does not fit.
    """
    if (args.source is None) == (args.preset is None):
        args.parser.error("name either SOURCE or --preset NAME")
    if args.preset is None:
        readable_file(args.source)
    else:
        if "," in args.preset:
            args.parser.error(
                f"argument --preset: {args.preset!r}: name the preset alone, and change it by "
                "options of the surface"
            )
        args.source = find_preset(args.preset).patch
    surface_parameters(args)
    if args.pigment is not None:
        pigment_range(args.pigment)
    options.load_options(args)  # wrong options are reported before Mitsuba is loaded


def gain_of(args: argparse.Namespace) -> Any:
    """Return the gain factor of --relative, or None without it.

    Raises a DiffractionError if --int-ior is not a number.
    """
    if not args.relative:
        options.refuse(args, ["int_ior"], ": only for --relative, or without a method")
        return None
    if args.int_ior is None:
        return Gain()
    try:
        return Gain(int_ior=float(args.int_ior))
    except ValueError as error:
        raise DiffractionError(
            f"int_ior='{args.int_ior}': relative reflectance takes a number, e.g. 1.5"
        ) from error


@options.command(
    "brdf-map", "picture a surface's reflection in every direction",
    "Picture the BRDF over all view directions for one light direction, seen from above: "
    "x = sin θ cos φ, y = sin θ sin φ, the normal in the middle. Writes linear numbers "
    "(EXR, 1/sr) and a picture with axes (PNG) beside them.",
    *SURFACE_SOURCE,
    ("-o --output OUT", "EXR, with a PNG beside it, or only a PNG; default: SOURCE's name with "
     "-map.exr in the current folder", path_ending_in(".exr", ".png")),
    options.MODE,
    options.Group("the map", (
        *options.direction(),
        *options.SPECTRUM,
        ("--wavelength NM", "one wavelength only, in false colours", number_between(10, 100_000)),
        ("--resolution N", "pixels a side", int, 512),
        ("--samples N", "directions in a pixel; default: enough to find every lobe", int),
        ("--illuminant", "light for the colours, daylight or equal energy", ILLUMINANTS, "D65"),
        ("--cosine", "map f·cosθo, the radiance of a lit surface, instead of f", bool),
        ("--exposure EV", "exposure of the PNG in stops; default: half of the diffracted light is "
         "darker than white", STOPS),
        ("--spectral", "also write every band as a channel of the EXR", bool),
    )),
    surface_options(),
    options.Group("methods of the 2014 thesis", (
        *options.method(None, "method to evaluate in NumPy, instead of the renderer's BSDF, for "
                        "R = 1 and light D65"),
        RELATIVE,
    )),
    options.heights(),
    options.json("settings and statistics of the map"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Make the map, and return the figures."""
    take_source(args)
    _refuse_contradictions(args)
    output = output_of(args, Path(f"{args.source.stem}-map.exr"), exr_and_png)
    *exr, png = written = exr_and_png(output)
    if args.spectral and not exr:
        args.parser.error(f"argument --spectral: bands need an EXR, e.g. -o {output.stem}.exr")

    bands = Bands.choose(args.wavelength_range, args.step, args.wavelength)
    evaluate = _by_bsdf if args.method is None else _by_method
    light = LightDirection(args.theta, args.phi)
    check_map(bands, args.resolution, args.samples, args.spectral)
    result, surface, method = evaluate(args, light, bands)
    exposure = None if bands.is_single else args.exposure
    if exr:
        notes = {"source": str(args.source), "surface": surface}
        save_exr(result, output, notes=notes | ({"method": args.method} if args.method else {}))
    save_png(result, png, exposure=exposure, title=args.source.name, notes=surface)
    shown = ""
    if not bands.is_single:
        shown = f", exposure {result.exposure() if exposure is None else exposure:+g} stops"
    seconds = elapsed(args)
    print(
        f"{' and '.join(map(str, written))}: {args.resolution} x {args.resolution} pixels, "
        f"{counted(result.samples, 'sample')} per pixel, {bands}{shown}, {seconds:.1f} s, {method}"
    )
    return {"source": args.source, "files": written, "theta": args.theta,
            "phi": args.phi, "pixels": args.resolution, "samples": result.samples,
            "bands": str(bands), "surface": surface, "method": method,
            "seconds": seconds}  # fmt: skip


def _by_bsdf(args: argparse.Namespace, light: Any, bands: Any) -> tuple[Any, str, str]:
    """Map the renderer's BSDF; also return its surface and the variant in words."""
    variant = set_variant(args.mode)
    check_variant(bands, args.illuminant, args.spectral)
    notes = _notes(args)
    with Bar(args) as bar:
        with warnings.catch_warnings():
            if notes:  # the plugin has them only when it builds the table
                check_surface(surface_parameters(args))
                say_warning(notes)
                warnings.filterwarnings("ignore", r".*\bnotes? on '", DiffractionWarning)
            bsdf = surface_bsdf(args)
        result = brdf_map(
            bsdf, light.theta, light.phi, resolution=args.resolution, samples=args.samples,
            illuminant=args.illuminant, cosine=args.cosine, spectral=args.spectral, progress=bar,
            wavelength=args.wavelength, wavelength_range=args.wavelength_range, step=args.step,
        )  # fmt: skip
    return result, _surface(bsdf), variant


def _notes(args: argparse.Namespace) -> str:
    """Return a line on the notes on heights; "" of presets, recipes and tables."""
    others = FileKind.TABLE, FileKind.ORDERS, FileKind.RECIPE
    if args.preset is not None or kind_of(args.source) in others:
        return ""
    # `surface_bsdf` reads the heights, too
    with warnings.catch_warnings(action="ignore", category=DiffractionWarning):
        patch, settings = options.load_patch(args)
        return options.notes(args, patch, TableSettings(**settings))


def _by_method(args: argparse.Namespace, light: Any, bands: Any) -> tuple[Any, str, str]:
    """Map a method of the thesis; also return its surface and the method in words."""
    samples, single = args.samples or 1, args.wavelength
    gain = gain_of(args)
    patch, settings = options.load_patch(args)
    settings |= {"wavelength_range": args.wavelength_range, "step": args.step}
    if single is not None:
        settings |= {"wavelength_range": (0.999 * single, 1.001 * single), "step": 0.001 * single}
    with Bar(args) as bar, warnings.catch_warnings(action="ignore", category=DiffractionWarning):
        method = make(args.method, patch, period=args.period, progress=bar, **settings)
        start = time.perf_counter()
        result = method_map(
            method, light, step=bands.width, wavelength=single, resolution=args.resolution,
            samples=samples, cosine=args.cosine, gain=gain, progress=bar,
        )  # fmt: skip
    quantity = "relative reflectance" if args.relative else "R = 1"
    how = f"method {args.method}: {time.perf_counter() - start:.2f} s for the map"
    return result, f"{quantity}; method {args.method}", how


def _refuse_contradictions(args: argparse.Namespace) -> None:
    """Refuse contradictory options that argparse does not find, with a usage error."""
    if args.wavelength is not None:
        many = ("wavelength_range", "step", "exposure", "spectral", "illuminant")
        options.refuse(args, many, ": has no effect with one --wavelength; leave one of both out")
    if args.method is None:
        options.refuse(args, ("period", "relative"), ": only with argument --method")
        return
    options.refuse(args, _OF_THE_BSDF, ": not allowed with argument --method")
    options.refuse_unused(args)


def surface_bsdf(args: argparse.Namespace) -> Any:
    """Return the BSDF of `add_surface` and `add_heights`, in the variant that is set."""
    parameters = options.table_options(args, tuple(_TABLE)) | surface_parameters(args)
    own = {FileKind.ORDERS: OF_ORDERS, FileKind.TABLE: ("ext_ior",)}
    options.refuse_of_table(args, args.preset or args.source, own.get(kind_of(args.source), ()))
    if (index := medium_index(args.ext_ior)) != 1.0:
        parameters["lateral_scale"] = index
        parameters["height_scale"] = index * (args.height_scale or 1.0)
    parameters |= options.given(args, options.HEIGHTS)
    if args.preset is not None:
        return bsdf_of(preset(args.preset, **parameters))
    return bsdf_of(bsdf_dict(str(args.source), **parameters))


def surface_parameters(args: argparse.Namespace) -> dict[str, Any]:
    """Return the options of `add_surface` that are parameters of the BSDF, by name."""
    if args.material is not None and args.int_ior is not None:
        args.parser.error("argument --int-ior: not allowed with argument --material")
    return options.given(args, _SURFACE)


def _surface(bsdf: Any) -> str:
    """Describe the reflecting surface in a line."""
    described: Surface = bsdf.describe()
    turn, scale = described.orientation.number, described.height_scale.number
    parts = [described.text, f"coherence width {described.coherence_width:g} µm"]
    if not described.solved:
        width = described.patch.width_text
        parts = [described.summary, f"{described.coherence}, coherence width {width}"]
    parts += [f"heights × {scale:g}"] if scale != 1.0 else []
    parts += [f"turned by {turn:g}°"] if turn != 0.0 else []
    return "; ".join(parts)
