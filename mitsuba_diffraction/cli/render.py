"""`mitsuba-diffraction render`: from an XML scene to a picture."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from .arguments import change, number_between, whole_number
from .console import Bar, mitsuba_warnings, say, say_warning
from .interrupts import INTERRUPTED
from .options import add_done, add_exposure, add_samples, add_scene, scene_parameters
from .plan import (
    MAKE,
    add_plan_options,
    check_plan_options,
    load_by_plan,
    plan_or_json,
    say_outside,
)
from .report import check_writable, save_done

if TYPE_CHECKING:
    from ..scene.passes import Result


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "render",
        help="render a Mitsuba scene",
        description=(
            "Render an XML scene to a linear EXR and a PNG beside it. Ctrl-C stops after the "
            "current pass and keeps the picture so far. With --frames, render a folder of PNG "
            "files while parameters of the scene change; frames that are there already, with the "
            "same settings, are kept, so an interrupted run goes on where it was."
        ),
    )
    add_scene(parser)
    parser.add_argument(
        "-o", "--output", metavar="OUT", type=Path,
        help="EXR, with a PNG beside it, or only a PNG; default: the scene's name with .exr in "
        "the current folder. With --frames: a folder, or a film, .webp or .gif, whose frames go "
        "into a folder of its name; default: the folder SCENE_frames",
    )  # fmt: skip
    add_samples(parser, 1, None)
    add_exposure(parser, 0.0, "of the PNG, in stops: +1 doubles the light; default: 0")
    parser.add_argument(
        "--preview", action="store_true",
        help="half the width and height, and at most 16 samples, unless -s is given",
    )  # fmt: skip
    parser.add_argument(
        "--plan", nargs="?", const=MAKE, metavar="PLAN", type=plan_or_json,
        help="render with tables of only what the scene needs: plan them first, or as in a file "
        "that `plan -o` wrote",
    )  # fmt: skip
    add_plan_options(parser)
    film = parser.add_argument_group("animation")
    film.add_argument(
        "--frames", metavar="N", type=whole_number(1), help="render N pictures, frame_0000.png on"
    )
    film.add_argument(
        "--animate", metavar="KEY=FROM:TO", type=change, action="append", default=[],
        help="change a parameter of the scene from the first frame to the last, e.g. "
        "sun_elevation=10:60, or lists: camera=0,-9,3:4,-9,3; may be given several times",
    )  # fmt: skip
    film.add_argument(
        "--turn", metavar="KEY", action="append", default=[],
        help="turn an angle of the scene, in degrees, once around from its value on, e.g. "
        "sun_azimuth for the light or turn for the snake; may be given several times",
    )  # fmt: skip
    film.add_argument("--exr", action="store_true", help="write a linear EXR of each frame, too")
    film.add_argument(
        "--fps", metavar="N", type=number_between(1, 100),
        help="frames a second of the film; default: 24",
    )  # fmt: skip
    add_done(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Render, and return the exit code."""
    check_plan_options(args)
    moving = bool(args.animate or args.turn)
    if args.frames is not None:
        if not moving:
            args.parser.error("argument --frames: say what changes, with --animate or --turn")
        if args.plan is not None:
            args.parser.error(
                "argument --plan: is for one picture; with --frames, camera and light may leave it"
            )
        from .frames import run_frames

        args.fps = args.fps or 24.0
        return run_frames(args)
    if moving or args.exr or args.fps:
        args.parser.error("--animate, --turn, --exr and --fps belong to --frames: say how many")
    return _run_one(args)


def _run_one(args: argparse.Namespace) -> int:
    parameters = scene_parameters(args)
    output = args.output or Path(args.scene.with_suffix(".exr").name)
    if output.suffix.lower() not in (".exr", ".png"):
        args.parser.error(
            f"argument -o: expected a name ending in .exr or .png, got {str(output)!r}"
        )
    only_png = output.suffix.lower() == ".png"
    png = output if only_png else output.with_suffix(".png")
    for path in dict.fromkeys((output, png)):
        check_writable(path)

    from ..scene.load import load_scene, preview_samples, sensor_of, set_variant, shrink
    from ..scene.passes import Stop, render_passes

    start = time.perf_counter()
    variant = set_variant(args.mode)
    with mitsuba_warnings():
        with Bar(args, unit=" spp", delay=0) as bar:
            spp = args.spp or 0

            def load() -> Any:
                return load_scene(args.scene, parameters)

            planned = None
            if args.plan is not None:
                bar(0, 0, "planning")
                planned = load_by_plan(args, variant, load, bar)
            bar(0, spp, "loading")
            scene = load() if planned is None else planned.scene
            sensor = sensor_of(scene, args.sensor)
            if args.preview:
                shrink(sensor)
            spp = spp or preview_samples(sensor, args.preview)
            if only_png and not _shows_colours(scene, sensor):
                raise DiffractionError(
                    f"the film of '{args.scene}' holds no colours that a PNG could show; "
                    f"name an EXR: -o {output.with_suffix('.exr')}"
                )
            with Stop() as stop:
                result = render_passes(
                    scene, sensor, spp=spp, seed=args.seed, variant=variant, stop=stop,
                    progress=bar,
                )  # fmt: skip
        if result.spp == 0:
            raise KeyboardInterrupt  # before the first pass: there is no picture
        if planned is not None:
            width, height = result.bitmap.size()
            say_outside(planned, width * height * result.spp)
        written = _written(result, args, None if only_png else output, png, variant)
    width, height = result.bitmap.size()
    samples = "1 sample" if result.spp == 1 else f"{result.spp} samples"
    seconds = time.perf_counter() - start
    print(
        f"{' and '.join(map(str, written))}: {width} x {height} pixels, {samples} per pixel, "
        f"{seconds:.1f} s, {variant}"
    )
    spent = {"variant": variant, "size": [width, height], "samples": result.spp}
    save_done(args, written, seconds, **spent, interrupted=result.interrupted)
    if result.interrupted:
        say(f"interrupted; the picture has {result.spp} of {spp} samples per pixel")
        return INTERRUPTED
    return 0


def _written(
    result: Result, args: argparse.Namespace, exr: Path | None, png: Path, variant: str
) -> list[Path]:
    """Write the picture, with warnings of what it lacks; the files."""
    from ..scene.pictures import colours_of, count_bad, write_exr, write_png

    bad = count_bad(result.bitmap)
    if bad:
        say_warning(f"{bad} pixels are not finite (NaN or infinite); they are black in a PNG")
    written = []
    if exr is not None:
        origin = {"scene": str(args.scene), "variant": variant, "seed": args.seed}
        write_exr(result.bitmap, exr, {**origin, "spp": result.spp})
        written.append(exr)
    colours = colours_of(result.bitmap)
    if colours is None:
        say_warning("the film holds no colours that a PNG could show; only the EXR was written")
    else:
        write_png(colours, png, args.exposure)
        written.append(png)
    return written


def _shows_colours(scene: object, sensor: object) -> bool:
    """Whether the film will hold something for a PNG, asked before the work is done."""
    from ..scene.pictures import colours_of

    film = sensor.film()  # type: ignore[attr-defined]
    film.prepare(scene.integrator().aov_names())  # type: ignore[attr-defined]
    return colours_of(film.bitmap()) is not None
