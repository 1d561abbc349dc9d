"""`mitsuba-diffraction compare`: the realtime picture of a scene against the path-traced one."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from ..errors import DiffractionError
from ..realtime.glsl.source import METHODS
from .arguments import whole_number
from .console import Bar, mitsuba_warnings
from .options import add_json, add_samples, add_scene, scene_parameters
from .report import check_writable, plain, save_json, save_report


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "compare",
        help="compare the realtime picture of a scene with the path-traced one",
        description=(
            "Render a scene by shaders and by path tracing, aligned to the pixel, and measure the "
            "difference: over all pixels in all direct light of the scene, and beside it in full "
            "transport; and, as a detail, where both see the same lit surface under lights "
            "without extent, by points and directions in place of the scene's."
        ),
    )
    add_scene(parser)
    parser.add_argument(
        "-o", "--output", metavar="FOLDER", type=Path,
        help="for pictures (EXR), sheets (PNG) and compare.json; default: the scene's name with "
        "_compare in the current folder",
    )  # fmt: skip
    parser.add_argument(
        "--method", nargs="+", metavar="NAME", choices=(*METHODS, "all"), default=["lut"],
        help=f"of the shaders: some of {', '.join(METHODS)}, or all; default: lut",
    )  # fmt: skip
    add_samples(parser, 2, 1024)
    parser.add_argument(
        "--full-spp", metavar="N", type=whole_number(0), default=64,
        help="samples per pixel of full transport; 0 leaves it out; default: 64",
    )  # fmt: skip
    parser.add_argument(
        "--frames", metavar="N", type=whole_number(4), default=512,
        help="of progressive light, in which lut and spectral are drawn; default: 512",
    )  # fmt: skip
    parser.add_argument(
        "--supersampling", metavar="N", type=whole_number(1), default=8,
        help="the shaders' samples along either side of a pixel (at most 2 of flss, nmm and pq); "
        "default: 8",
    )  # fmt: skip
    add_json(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Compare, and return the exit code."""
    parameters = scene_parameters(args)
    folder = args.output or Path(f"{args.scene.stem}_compare")
    if folder.exists() and not folder.is_dir():
        raise DiffractionError(f"-o {folder}: it is a file; name a folder")
    check_writable(folder / "compare.json", make_folder=True)

    from ..realtime.comparison.run import Comparison
    from ..realtime.comparison.table import markdown
    from ..realtime.glsl.scene import check_variant
    from ..scene.load import load_scene, sensor_of, set_variant

    start = time.perf_counter()
    variant = set_variant(args.mode)
    check_variant(variant)
    every = "all" in args.method
    with mitsuba_warnings(), Bar(args, unit=" spp", delay=0) as bar:
        bar(0, args.spp, "loading")
        scene = load_scene(args.scene, parameters)
        sensor_of(scene, args.sensor)
        comparison = Comparison(
            scene, str(args.scene), variant, folder, args.sensor, args.spp, args.full_spp,
            args.frames // 4 * 4, args.supersampling, args.seed, bar,
        )  # fmt: skip
        found = comparison.run(METHODS if every else args.method, leave_out=every)
    found = {"scene": found["scene"], "parameters": parameters, **found}
    save_json(folder / "compare.json", found)
    save_report(args, found)
    print(markdown(plain(found)))
    print(f"{folder}: pictures, sheets and compare.json, {time.perf_counter() - start:.0f} s")
    return 0
