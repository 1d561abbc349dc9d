"""`render --frames`: which frames there are, why each is rendered, and the film of them."""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ..scene.frames import FILMS, MISSING, Frame, digest_of
from ..scene.parameters import values_of_frames
from .console import Bar, mitsuba_warnings, say
from .interrupts import INTERRUPTED
from .options import scene_parameters
from .report import check_writable, save_report
from .workers import client_of, film_of, on_workers, say_report


def run_frames(args: argparse.Namespace) -> int:
    """Render the frames that are not there yet, then the film; return the exit code."""
    folder, film = _outputs(args)
    check_writable(folder / "frame_0000.png", make_folder=True)
    if film is not None:
        check_writable(film)
    frames = _frames(args, folder)
    reasons = {frame.png: frame.outdated(args.exr) for frame in frames}
    to_do = [frame for frame in frames if reasons[frame.png]]
    _say_why(reasons)

    from ..scene.frames import render_frames, write_film
    from ..scene.load import set_variant

    start = time.perf_counter()
    done, workers = 0, None
    if to_do and on_workers(args):
        done, workers = _on_workers(args, to_do, folder)
    elif to_do:
        variant = set_variant(args.mode)
        with mitsuba_warnings(), Bar(args, unit=" spp", delay=0) as bar:
            bar(0, 0, "loading")
            for _ in render_frames(args.scene, to_do, variant, with_exr=args.exr, progress=bar):
                done += 1
    report = {"scene": args.scene, "frames": len(frames), "new": done,
              "files": [frame.png for frame in frames if frame.png.exists()], "film": None,
              "interrupted": done < len(to_do), "seconds": time.perf_counter() - start,
              "workers": workers}  # fmt: skip
    if done < len(to_do):
        save_report(args, report)
        there = len(frames) - len(to_do) + done
        say(
            f"interrupted; {there} of {len(frames)} frames are done, run the command again to "
            "continue"
        )
        return INTERRUPTED
    print(f"{folder}: {len(frames)} frames, {done} of them new, {report['seconds']:.1f} s")
    if film is not None:
        write_film([frame.png for frame in frames], film, args.fps)
        print(f"{film}: {len(frames) / args.fps:.3g} s at {args.fps:g} frames a second")
    save_report(args, report | {"film": film})
    return 0


def _on_workers(
    args: argparse.Namespace, to_do: Sequence[Frame], folder: Path
) -> tuple[int, dict[str, Any]]:
    """Render frames on workers; how many came before Ctrl-C, and what the workers did."""
    from ..cluster.frames import Wanted
    from ..scene.frames import write_frame
    from ..scene.load import set_variant
    from ..scene.passes import Stop

    variant, done = set_variant(args.mode), 0
    wanted = [Wanted(frame.values, args.spp, frame.settings["seed"]) for frame in to_do]
    with mitsuba_warnings(), client_of(args) as client:
        film = film_of(args, client, wanted, variant, folder / "passes")
        with Bar(args, unit=" tasks", delay=0) as bar, Stop() as stop:
            for frame, result in zip(to_do, film.render(stop, bar), strict=False):
                write_frame(frame, result.bitmap, args.scene, variant, args.exr)
                film.forget(done)
                done += 1
        return done, say_report(film)


def _say_why(reasons: Mapping[Path, tuple[str, str] | None]) -> None:
    """Which frames are kept, and for what reason others are not."""
    examples: dict[str, tuple[Path, str]] = {}
    again: Counter[str] = Counter()
    for path, reason in reasons.items():
        if reason is not None and reason != MISSING:
            again[reason[0]] += 1
            examples.setdefault(reason[0], (path, reason[1]))
    for name, number in again.items():
        path, example = examples[name]
        say(
            f"{number} of {len(reasons)} frames are rendered again because of their {name}: of "
            f"{path.name} {example}"
        )
    kept = sum(reason is None for reason in reasons.values())
    if kept:
        say(f"{kept} of {len(reasons)} frames are up to date")


def _outputs(args: argparse.Namespace) -> tuple[Path, Path | None]:
    """The folder of the frames, and the film."""
    output = args.output or Path(f"{args.scene.stem}_frames")
    if output.suffix.lower() in FILMS:
        return output.with_suffix(""), output
    if output.suffix:
        args.parser.error(
            f"argument -o: with --frames it names a folder, or a film ending in "
            f"{' or '.join(FILMS)}, not {str(output)!r}"
        )
    return output, None


def _frames(args: argparse.Namespace, folder: Path) -> list[Frame]:
    given = scene_parameters(args)
    animated = [one.name for one in args.animate]
    names = animated + args.turn
    for name in names:
        if names.count(name) > 1:
            args.parser.error(f"{name!r} is set more than once; keep one --animate or --turn of it")
    for name in animated:
        if name in given:
            args.parser.error(
                f"argument -D: --animate {name}= sets its value in every frame; leave "
                f"-D {name}={given[name]} out"
            )
    every = values_of_frames(args.scene, given, args.frames, args.animate, args.turn)
    content = digest_of(args.scene, given)
    return [
        Frame(
            folder / f"frame_{n:04d}.png",
            values,
            {
                "scene": content,
                **{f"-D {name}": value for name, value in sorted(values.items())},
                "samples": args.spp or "the scene's",
                "seed": args.seed + n,
                "variant": args.mode or "the default",
                "sensor": args.sensor,
                "exposure": args.exposure,
                "preview": args.preview,
                "version": version("mitsuba_diffraction"),
            },
        )
        for n, values in enumerate(every)
    ]
