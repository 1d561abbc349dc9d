"""`mitsuba-diffraction view`: a window on a scene, drawn in real time."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from ..errors import DiffractionError
from ..realtime.glsl.source import METHODS
from .arguments import whole_number
from .console import mitsuba_warnings
from .options import add_exposure, add_scene, scene_parameters
from .report import check_writable


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "view",
        help="look at a scene in a window, in real time",
        description=(
            "Open a window on a scene, drawn by shaders. Turn it with the left button, drag the "
            "light with the right one, move with the middle one or shift, zoom with the wheel; "
            "S takes a screenshot, P sends the view to the path tracer, R resets, Esc closes."
        ),
    )
    add_scene(parser)
    parser.add_argument("--method", choices=METHODS, default="lut", help="default: lut")
    add_exposure(parser, 0.0, "stops to start with: +1 doubles the light; default: 0")
    parser.add_argument(
        "--size", metavar="WxH", type=_size, default=(1280, 800),
        help="of the window, pixels; default: 1280x800",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", metavar="FOLDER", type=Path, default=Path(),
        help="for screenshots; default: the current folder",
    )  # fmt: skip
    parser.add_argument(
        "--frames", metavar="N", type=whole_number(0), default=0,
        help="close after so many and print their time; default: 0, never",
    )  # fmt: skip
    parser.add_argument(
        "--window", choices=("pyglet", "glfw", "sdl2", "headless"), default="pyglet",
        help="what opens the window; glfw and sdl2 need packages of their own, headless opens none",
    )  # fmt: skip
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Show the scene, and return the exit code."""
    parameters = scene_parameters(args)
    check_writable(args.output / "view_000.png")
    try:
        from ..realtime.glsl.viewer import show
    except ImportError as error:
        raise DiffractionError(
            f"view needs {error.name}: pip install 'mitsuba-diffraction[view]'"
        ) from error
    from ..realtime.glsl.scene import check_variant
    from ..scene.load import load_scene, sensor_of, set_variant

    check_variant(set_variant(args.mode))
    with mitsuba_warnings():
        scene = load_scene(args.scene, parameters)
        sensor_of(scene, args.sensor)
        frames, milliseconds = show(
            scene, sensor=args.sensor, method=args.method, stops=args.exposure, size=args.size,
            folder=args.output, frames=args.frames, window=args.window,
        )  # fmt: skip
    print(f"{frames} frames, {milliseconds:.3g} ms each at the end, method {args.method}")
    return 0


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{2,5})x(\d{2,5})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"expected a size like 1280x800, got {text!r}")
    return int(found[1]), int(found[2])
