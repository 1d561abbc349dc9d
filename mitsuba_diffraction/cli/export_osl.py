"""`export-osl`: a surface as a shader for Blender's Cycles."""

from __future__ import annotations

import argparse
import re
import time
from pathlib import Path

from ..errors import DiffractionError
from . import options
from .brdf_map import add_surface, add_surface_source, surface_bsdf, take_source
from .console import Bar, mitsuba_warnings
from .report import check_outputs, save_report


def add_parser(subparsers: options.Subparsers) -> None:
    parser = options.add_command(
        subparsers, "export-osl", run,
        "write a surface as a shader for Blender's Cycles (OSL)",
        "Write a shader in Open Shading Language with its textures (EXR), and a script that adds "
        "the material to a .blend file: docs/blender.md.",
    )  # fmt: skip
    add_surface_source(parser)
    options.add_output(
        parser, "to write into, made if it is missing; default: SOURCE's name with -osl in the "
        "current folder",
    )  # fmt: skip
    parser.add_argument(
        "--name", metavar="NAME",
        help="name of the shader and its files; default: diffraction_ and SOURCE's name",
    )  # fmt: skip
    options.add_mode(parser)
    add_surface(parser.add_argument_group("the surface"))
    options.add_heights(parser)
    options.add_json(parser, "the files and their settings")


def run(args: argparse.Namespace) -> int:
    """Export, and return the exit code."""
    take_source(args)
    folder = args.output or Path(f"{args.source.stem}-osl")
    if folder.exists() and not folder.is_dir():
        raise DiffractionError(f"-o {folder}: it is a file; name a folder")
    name = args.name or "diffraction_" + re.sub(r"[^A-Za-z0-9_]", "_", args.source.stem)
    outputs = [folder / f"{name}.osl"]
    check_outputs(outputs, [args.source], "shader", make_folder=True)
    options.load_options(args)  # wrong options are reported before Mitsuba is loaded

    from ..osl import export
    from ..scene.load import set_variant

    start = time.perf_counter()
    set_variant(args.mode)
    with mitsuba_warnings(), Bar(args) as bar:
        bar(0, 0, "making tables")
        exported = export(surface_bsdf(args), folder, name)
    files = [exported.shader, exported.document, *exported.textures.values()]
    error = ", ".join(f"{key} {value:.2g}" for key, value in exported.error.items())
    size = sum(file.stat().st_size for file in files)
    print(
        f"{exported.shader}: {size / 1e6:.1f} MB with textures, "
        f"{time.perf_counter() - start:.1f} s; {exported.surface}; error of the textures, as a "
        f"share of the light: {error}"
    )
    save_report(args, {"source": args.source, "folder": folder, "files": files,
                       "surface": exported.surface, "error": exported.error,
                       "bytes": size})  # fmt: skip
    return 0
