"""`mitsuba-diffraction export-shader`: a surface's diffraction for other programs."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from .brdf_map import add_surface, surface_bsdf
from .console import Bar, mitsuba_warnings
from .options import add_heights, add_json, add_mode, load_options
from .report import check_outputs, save_report

_METHODS = ("lut", "spectral")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "export-shader",
        help="write a surface's diffraction as GLSL with its textures, for other programs",
        description=(
            "Write a function `vec3 diffraction(vec3 wi, vec3 wo)` in GLSL, its textures (EXR) and "
            "constants (JSON), and a material of three.js that uses them. How to bring it into "
            "another engine: docs/realtime.md."
        ),
    )
    parser.add_argument(
        "source", metavar="SOURCE", type=Path,
        help="table, recipe (.toml), or heights of any format",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", metavar="FOLDER", type=Path,
        help="to write into, made if it is missing; default: SOURCE's name with -shader in the "
        "current folder",
    )  # fmt: skip
    parser.add_argument(
        "--method", choices=_METHODS, nargs="+", default=_METHODS,
        help="colours of daylight summed up beforehand, a loop over wavelengths, or both; "
        "default: both",
    )  # fmt: skip
    add_mode(parser)
    add_surface(parser.add_argument_group("the surface"), turned=False)
    add_heights(parser)
    add_json(parser, "what was written")
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Export, and return the exit code."""
    if args.material is not None and args.int_ior is not None:
        args.parser.error("argument --int-ior: not allowed with argument --material")
    folder = args.output or Path(f"{args.source.stem}-shader")
    check_outputs([folder / "constants.json"], [args.source], "shader", make_folder=True)
    load_options(args)  # what does not fit is reported before Mitsuba is loaded

    from ..realtime.glsl.export import export_shader
    from ..realtime.glsl.scene import check_variant
    from ..scene.load import set_variant

    start = time.perf_counter()
    check_variant(set_variant(args.mode))
    with mitsuba_warnings(), Bar(args) as bar:
        bar(0, 0, "making tables")
        shader = export_shader(surface_bsdf(args), folder, list(dict.fromkeys(args.method)))
    files = [folder / "diffraction.glsl", *(folder / f"{t.name}.exr" for t in shader.textures)]
    code, *textures = (file.stat().st_size for file in files)
    print(
        f"{folder}: {', '.join(shader.functions.values())}: {code / 1e3:.1f} kB of GLSL, "
        f"{len(textures)} textures of {sum(textures) / 1e6:.1f} MB, "
        f"{time.perf_counter() - start:.1f} s; {shader.surface}"
    )
    save_report(args, {"source": args.source, "folder": folder, "files": files,
                       "functions": shader.functions, "surface": shader.surface,
                       "bytes": {"code": code, "textures": sum(textures)}})  # fmt: skip
    return 0
