"""`mitsuba-diffraction export-viewer`: a scene as a page for a browser."""

from __future__ import annotations

import argparse
import time

from ..realtime.web.tables import WEB_METHODS
from .arguments import path_ending_in
from .console import Bar, mitsuba_warnings, say_warning
from .options import add_json, add_scene, scene_parameters
from .report import check_writable, save_report


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "export-viewer",
        help="write a page that shows a scene in a browser, without a server",
        description=(
            "Write one self-contained page of HTML, of at most 25 MB, that draws a scene with "
            "WebGL 2: orbit, pan, zoom, and drag the light. Tables are rounded to as many digits "
            "as fit; the ΔE2000 that this makes is printed and stands on the page."
        ),
    )
    add_scene(parser)
    parser.add_argument(
        "output", metavar="OUT", type=path_ending_in(".html"), help="the page to write"
    )
    parser.add_argument(
        "--method", choices=(*WEB_METHODS, "all"), default="all",
        help="that the page offers; all leaves out what does not fit; default: all",
    )  # fmt: skip
    add_json(parser, "what the page shows")
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Export, and return the exit code."""
    parameters = scene_parameters(args)
    check_writable(args.output)

    from ..realtime.glsl.scene import check_variant
    from ..realtime.web import export_viewer
    from ..scene.load import load_scene, sensor_of, set_variant

    start = time.perf_counter()
    check_variant(set_variant(args.mode))
    with mitsuba_warnings(), Bar(args, delay=0) as bar:
        bar(0, 0, "loading")
        scene = load_scene(args.scene, parameters)
        sensor_of(scene, args.sensor)
        page = export_viewer(
            scene, args.output, title=args.scene.stem, sensor=args.sensor, progress=bar,
            methods=WEB_METHODS if args.method == "all" else (args.method,),
        )  # fmt: skip
    if page.omissions:
        say_warning(f"the page does not show: {'; '.join(dict.fromkeys(page.omissions))}")
    for method, reason in page.left_out.items():
        say_warning(f"the page goes without {method}: {reason}")
    losses = "; ".join(
        f"{method} ΔE2000 {mean:.2f} (99 % below {most:.2f})"
        for method, (mean, most) in page.loss.items()
    )
    size, seconds = args.output.stat().st_size, time.perf_counter() - start
    print(f"{args.output}: {size / 1e6:.1f} MB, {seconds:.1f} s; rounding: {losses}")
    save_report(args, {"scene": args.scene, "files": [args.output], "bytes": size,
                       "delta_e": {m: {"mean": mean, "99 %": most}
                                   for m, (mean, most) in page.loss.items()},
                       "left_out": page.left_out, "omissions": page.omissions,
                       "seconds": seconds})  # fmt: skip
    return 0
