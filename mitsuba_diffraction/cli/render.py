"""`mitsuba-diffraction render`: from an XML scene to a picture.

With --frames: which frames exist, why others are rendered, and their film."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ..analysis.observers import Eye
from ..cluster import FrameRequest
from ..digests import key_of, sha256_of
from ..errors import DiffractionError, counted
from ..extras import optional
from ..scene import load_scene, set_variant
from ..scene.denoise import denoised
from ..scene.elements import surfaces_text
from ..scene.frames import (
    FILMS,
    Frame,
    check_film,
    check_frames,
    render_frames,
    write_film,
    write_frame,
)
from ..scene.load import preview_samples, sensor_of
from ..scene.parameters import files_of, values_of_frames
from ..scene.passes import Result, Stop, integrator_of, render_passes
from ..scene.pictures import colours_of, count_bad, write_exr, write_png
from . import options, scene_options
from .animation import ANIMATION, say_why
from .console import Bar, say, say_warning
from .interrupt import INTERRUPTED, keep_in_mind
from .observed import OBSERVER, bands_of, eye_of, save_observed
from .plan import PLAN, check_plan_options, load_by_plan, recipe_file
from .report import Figures, check_outputs, elapsed, exr_and_png, output_of
from .studio import STUDIO_OPTIONS, take_studio
from .values import STOPS
from .workers import THREADS, WORKERS, film_of, on_workers, say_report


@options.command(
    "render", "render a Mitsuba scene",
    "Render an XML scene to a linear EXR and a PNG beside it. Ctrl-C stops after the "
    "current pass and keeps the picture so far. With --frames, render a folder of PNG "
    "files while parameters of the scene change; existing frames with the same "
    "settings are kept, so an interrupted run can be continued.",
    *scene_options.SCENE,
    ("-o --output OUT", "EXR with a PNG beside it, or a PNG; with --frames a folder or .webp, "
     ".gif, .mp4; default: SCENE.exr or SCENE_frames", Path),
    *options.samples(1, None),
    ("--exposure EV", "of the PNG, in stops: +1 doubles the light", STOPS, 0.0),
    options.VIEW,
    ("--denoise", "also write a denoised picture, NAME_denoised (extra denoise); with "
     "--frames, denoise each frame", bool),
    ("--preview", "half the width and height, and at most 16 samples, unless -s is given",
     bool),
    ("--plan RECIPE.toml", "render with tables limited to what the scene needs: by the recipes "
     "of `plan -o`, or without any, planned first", recipe_file, None, {"nargs": "*"}),
    *PLAN,
    *OBSERVER,
    options.json("size, samples, time and files of the picture"),
    options.Group("animation", ANIMATION),
    options.Group("a mesh in a few words", STUDIO_OPTIONS),
    WORKERS,
    THREADS,
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Render, and return the figures."""
    check_plan_options(args)
    take_studio(args)
    scene_options.put_on_stage(args)
    eye = eye_of(args)
    if on_workers(args):
        options.refuse(args, ("plan", "denoise"), ": is for one process; leave the workers out")
    moving = bool(args.animate or args.turn)
    if args.denoise:
        optional("pyoidn")
    if args.frames is not None:
        if not moving:
            args.parser.error("argument --frames: say what changes, with --animate or --turn")
        why = ": is for one picture; with --frames, camera and light may leave it"
        options.refuse(args, ["plan"], why)
        return _run_frames(args)
    options.refuse(args, ("animate", "turn", "exr", "fps"), ": belongs to --frames; say how many")
    if eye is None and on_workers(args):
        return _on_workers(args)
    return _run_one(args, eye)


def _output(args: argparse.Namespace) -> Path:
    """Return the file of `-o`, or its default, after checking that all files can be written."""
    if args.output is not None and args.output.suffix.lower() not in (".exr", ".png"):
        args.parser.error(
            f"argument -o: expected a name ending in .exr or .png, got {str(args.output)!r}"
        )
    return output_of(args, Path(f"{args.name.stem}.exr"), partial(_files, args))


def _files(args: argparse.Namespace, output: Path) -> list[Path]:
    """Return all files of an output of this name."""
    return exr_and_png(output) + (exr_and_png(_denoised(output)) if args.denoise else [])


def _denoised(output: Path) -> Path:
    """Return the name of the denoised picture beside the noisy one."""
    return output.with_name(f"{output.stem}_denoised{output.suffix}")


def _on_workers(args: argparse.Namespace) -> Figures:
    parameters = scene_options.scene_parameters(args)
    output = _output(args)

    variant = set_variant(args.mode)
    keep = output.with_name(f"{output.name}.passes")
    keep_in_mind(f"finished passes are kept in '{keep}': run the command again to go on")
    with film_of(args, [FrameRequest(parameters, args.spp, args.seed)], variant, keep) as film:
        _check_colours(args, output, film.scene, film.sensor)
        with Bar(args, unit=" passes", delay=0) as bar, Stop() as stop:
            reports = [_finish(args, result, output, variant, film.scene)
                       for result in film.render(stop, bar)]  # fmt: skip
        if not reports:
            raise KeyboardInterrupt
        return reports[0] | {"workers": say_report(film)}


def _run_one(args: argparse.Namespace, eye: Eye | None) -> Figures:
    parameters = scene_options.scene_parameters(args)
    output = _output(args)
    variant = set_variant(args.mode)
    bands = None if eye is None else bands_of(args, eye, variant)
    whole = partial(
        load_scene, args.scene, parameters, box_filter=args.denoise, bands=bands, say=say
    )
    with Bar(args, unit=" spp", delay=0) as bar:
        bar(0, 0, "loading")
        scene = whole() if args.plan is None else load_by_plan(args, variant, whole, bar)
        sensor = sensor_of(scene, args.sensor, args.preview)
        spp = args.spp or preview_samples(sensor, args.preview)
        check_outputs(_files(args, output))  # of what only loading tells
        _check_colours(args, output, scene, sensor)
        with Stop() as stop:
            result = render_passes(scene, sensor, spp=spp, seed=args.seed, stop=stop, progress=bar)
    if result.spp == 0:
        raise KeyboardInterrupt  # interrupted before the first pass, without a picture
    if result.interrupted:
        say(f"interrupted; the picture has {result.spp} of {counted(spp, 'sample')} per pixel")
        args.code = INTERRUPTED
    report = _finish(args, result, output, variant, scene, eye)
    if args.denoise:
        clean = denoised(scene, sensor, result.bitmap, result.spp, args.seed)
        files = _written(args, clean, _denoised(output), {"denoised": "Open Image Denoise"})
        print(f"{' and '.join(map(str, files))}: denoised")
        report["files"] += files
    return report


def _finish(
    args: argparse.Namespace, result: Result, output: Path, variant: str, scene: Any,
    eye: Eye | None = None,
) -> Figures:  # fmt: skip
    """Write the picture, print warnings and a summary, and return the figures for --json."""
    if bad := count_bad(result.bitmap):
        say_warning(f"{counted(bad, 'pixel')} not finite (NaN or infinite): black in a PNG")
    origin = {"variant": variant, "seed": args.seed, "spp": result.spp}
    channels, seen = "", {}
    if eye is None:
        written = _written(args, result.bitmap, output, origin)
    else:
        written = save_observed(args, eye, result.bitmap, output, origin)
        channels = f"channels {', '.join(eye.names)}, "
        seen = {"observer": args.observer, "receptors": list(eye.names)}
    (width, height), samples = result.bitmap.size(), counted(result.spp, "sample")
    seconds, surfaces = elapsed(args), surfaces_text(scene)
    print(
        f"{' and '.join(map(str, written))}: {width} x {height} pixels, {channels}{samples} per "
        f"pixel, {seconds:.1f} s, {variant}{surfaces}"
    )
    return {
        "scene": args.scene, "files": written, "pixels": [width, height],
        "surfaces": surfaces.removeprefix("; "), **origin, **seen,
        "interrupted": result.interrupted, "seconds": seconds,
    }  # fmt: skip


def _written(
    args: argparse.Namespace, picture: Any, output: Path, origin: Mapping[str, str | int]
) -> list[Path]:
    """Write a picture, its PNG if the film holds colours; return the files."""
    *exr, png = exr_and_png(output)
    for path in exr:
        write_exr(picture, path, {"scene": str(args.scene), **origin})
    colours = colours_of(picture)
    if colours is None:
        say_warning("the film holds no colours that a PNG could show; only the EXR was written")
        return exr
    write_png(colours, png, args.exposure, args.view)
    return [*exr, png]


def _check_colours(args: argparse.Namespace, output: Path, scene: Any, sensor: Any) -> None:
    """Refuse a film without colours for a PNG alone, before the work is done."""
    if exr_and_png(output) != [output]:
        return
    film = sensor.film()
    film.prepare(integrator_of(scene).aov_names())
    if colours_of(film.bitmap()) is None:
        raise DiffractionError(
            f"the film of '{args.scene}' holds no colours that a PNG could show; "
            f"name an EXR: -o {output.with_suffix('.exr')}"
        )


def _run_frames(args: argparse.Namespace) -> Figures:
    """Render the frames that are missing or outdated, then the film; return the figures."""
    folder, film = _folder_and_film(args)
    if film is None:
        options.refuse(args, ["fps"], ": is for a film; name one, e.g. -o NAME.mp4")
    else:
        check_film(film)
        check_outputs([film])
    frames = _frames(args, folder)
    reasons = {frame.png: frame.outdated(args.exr) for frame in frames}
    to_do = [frame for frame in frames if reasons[frame.png]]
    say_why(reasons)

    done, workers = 0, None
    if to_do:
        variant = set_variant(args.mode)
        with Bar(args, delay=0) as bar:
            bar(0, 0, "checking the frames")
            check_frames(args.scene, to_do)
        keep_in_mind(f"finished frames are in '{folder}': run the command again to continue")
        if on_workers(args):
            done, workers = _frames_on_workers(args, to_do, folder, variant)
        else:
            with Bar(args, unit=" spp", delay=0) as bar:
                bar(0, 0, "loading")
                here = render_frames(args.scene, to_do, with_exr=args.exr, progress=bar, say=say)
                done = sum(1 for _ in here)
    report = {"scene": args.scene, "frames": len(frames), "new": done,
              "files": [frame.png for frame in frames if frame.png.exists()], "film": None,
              "interrupted": done < len(to_do), "seconds": elapsed(args),
              "workers": workers}  # fmt: skip
    if done < len(to_do):
        there = len(frames) - len(to_do) + done
        say(
            f"interrupted; {there} of {len(frames)} frames are done, run the command again to "
            "continue"
        )
        args.code = INTERRUPTED
        return report
    print(
        f"{folder}: {counted(len(frames), 'frame')}, {done} of them new, {report['seconds']:.1f} s"
    )
    if film is not None:
        write_film([frame.png for frame in frames], film, args.fps)
        print(f"{film}: {len(frames) / args.fps:.3g} s at {args.fps:g} frames a second")
    return report | {"film": film}


def _frames_on_workers(
    args: argparse.Namespace, to_do: Sequence[Frame], folder: Path, variant: str
) -> tuple[int, dict[str, Any]]:
    """Render frames on workers; return how many were finished, and what the workers did."""
    done = 0
    wanted = [FrameRequest(frame.values, args.spp, frame.settings["seed"]) for frame in to_do]
    with film_of(args, wanted, variant, folder / "passes") as film:
        with Bar(args, unit=" passes", delay=0) as bar, Stop() as stop:
            for result, frame in zip(film.render(stop, bar), to_do, strict=False):
                write_frame(frame, result.bitmap, args.scene, args.exr)
                done += 1
        return done, say_report(film)


def _folder_and_film(args: argparse.Namespace) -> tuple[Path, Path | None]:
    """Return the folder of the frames, and the film, if there is one."""
    default = Path(f"{args.name.stem}_frames")
    output = output_of(args, default, partial(_files_of_frames, args), make_folder=True)
    if output.suffix.lower() in FILMS:
        return output.with_suffix(""), output
    if output.suffix:
        args.parser.error(
            f"argument -o: with --frames it names a folder, or a film ending in "
            f"{' or '.join(FILMS)}, not {str(output)!r}"
        )
    return output, None


def _files_of_frames(args: argparse.Namespace, folder: Path) -> list[Path]:
    """Return the files of the frames in a folder, or of a film's."""
    if folder.suffix.lower() in FILMS:
        folder = folder.with_suffix("")
    suffixes = (".png", ".exr") if args.exr else (".png",)
    return [folder / f"frame_{n:04d}{s}" for n in range(args.frames) for s in suffixes]


def _frames(args: argparse.Namespace, folder: Path) -> list[Frame]:
    fixed = scene_options.scene_parameters(args)
    animated = [change.name for change in args.animate]
    names = animated + args.turn
    for name in names:
        if names.count(name) > 1:
            args.parser.error(f"{name!r} is set more than once; keep one --animate or --turn of it")
    for name in animated:
        if name in fixed:
            args.parser.error(
                f"argument -D: --animate {name}= sets its value in every frame; leave "
                f"-D {name}={fixed[name]} out"
            )
    every = values_of_frames(args.scene, fixed, args.frames, args.animate, args.turn)
    content = key_of(*map(sha256_of, files_of(args.scene, fixed)))
    return [
        Frame(
            folder / f"frame_{n:04d}.png",
            values,
            {
                "scene": content,
                **{f"-D {name}": value for name, value in sorted(values.items())},
                "samples": args.spp or "the scene's",
                # noise that stands still: a denoiser makes the same of it in all frames
                "seed": args.seed + (0 if args.denoise else n),
                "variant": args.mode or "the default",
                "sensor": args.sensor,
                "exposure": args.exposure,
                "view": args.view,
                "preview": args.preview,
                "denoise": args.denoise,
                "version": version("mitsuba_diffraction"),
            },
        )
        for n, values in enumerate(every)
    ]
