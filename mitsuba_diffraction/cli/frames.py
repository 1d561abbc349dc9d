"""`render --frames`: a scene many times, in files that a later run with the same settings keeps."""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ..atomic import atomic_path
from ..errors import DiffractionError
from ..scene.parameters import files_of
from .animation import values_of_frames
from .console import say, say_warning
from .output import check_writable
from .progress import Bar
from .scene_options import scene_parameters

#: Suffixes of films, and what Pillow needs to know about each.
FILMS: dict[str, dict[str, Any]] = {
    ".webp": {"quality": 85, "method": 4},
    ".gif": {"optimize": True},
}
_KEY = "mitsuba-diffraction"  # of the text in a frame's PNG
_INTERRUPTED = 130
_MISSING = ("", "")


@dataclass(frozen=True)
class Frame:
    """One frame: its file, the scene's parameters, and the settings that decide its pixels."""

    png: Path
    values: dict[str, str]
    settings: dict[str, Any]

    @property
    def exr(self) -> Path:
        """The linear picture beside the PNG."""
        return self.png.with_suffix(".exr")

    def outdated(self, with_exr: bool) -> tuple[str, str] | None:
        """Why the frame has to be rendered, and an example; None if the file is this frame.

        Raises
        ------
        DiffractionError
            If the file there is something else.
        """
        if not self.png.exists():
            return _MISSING
        before = _settings_in(self.png)
        if before is None:
            raise DiffractionError(
                f"'{self.png}' is there, and no frame of this command; name another folder with -o"
            )
        for name in {**before, **self.settings}:
            old, new = before.get(name), self.settings.get(name)
            if old != new:
                return name, "it changed" if name == "scene" else f"it was {old} and is {new}"
        return ("EXR", "it is missing") if with_exr and not self.exr.exists() else None


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

    start = time.perf_counter()
    done = 0
    with Bar(args, unit=" spp", delay=0) as bar:
        for _ in _rendered(args, to_do, bar):
            done += 1
    if done < len(to_do):
        there = len(frames) - len(to_do) + done
        say(f"interrupted; {there} of {len(frames)} frames are done, the same command goes on")
        return _INTERRUPTED
    print(
        f"{folder}: {len(frames)} frames, {done} of them new, {time.perf_counter() - start:.1f} s"
    )
    if film is not None:
        write_film([frame.png for frame in frames], film, args.fps)
        print(f"{film}: {len(frames) / args.fps:.3g} s at {args.fps:g} frames a second")
    return 0


def _say_why(reasons: Mapping[Path, tuple[str, str] | None]) -> None:
    """Which frames are kept, and for what reason others are not."""
    examples: dict[str, tuple[Path, str]] = {}
    again: Counter[str] = Counter()
    for path, reason in reasons.items():
        if reason is not None and reason != _MISSING:
            again[reason[0]] += 1
            examples.setdefault(reason[0], (path, reason[1]))
    for name, number in again.items():
        path, example = examples[name]
        say(f"{number} of {len(reasons)} frames are made anew for their {name}: of {path.name} "
            f"{example}")  # fmt: skip
    kept = sum(reason is None for reason in reasons.values())
    if kept:
        say(f"{kept} of {len(reasons)} frames are there already")


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
                f"argument -D: --animate {name}= says its value in every frame; leave "
                f"-D {name}={given[name]} out"
            )
    every = values_of_frames(args.scene, given, args.frames, args.animate, args.turn)
    content = _digest(args.scene, given)
    frames = []
    for n, values in enumerate(every):
        settings = {
            "scene": content,
            **{f"-D {name}": value for name, value in sorted(values.items())},
            "samples": args.spp or "the scene's",
            "seed": args.seed + n,
            "variant": args.mode or "the default",
            "sensor": args.sensor,
            "exposure": args.exposure,
            "preview": args.preview,
            "version": version("mitsuba_diffraction"),
        }
        frames.append(Frame(folder / f"frame_{n:04d}.png", values, settings))
    return frames


def _rendered(args: argparse.Namespace, frames: list[Frame], bar: Bar) -> Iterator[Frame]:
    """Render and write frame after frame; ends early after Ctrl-C."""
    from ..scene.load import load_scene, preview_samples, sensor_of, set_variant, shrink
    from ..scene.passes import Stop, render_passes
    from ..scene.pictures import colours_of, count_bad, write_exr, write_png
    from .console import warnings_as_ours

    if not frames:
        return
    variant = set_variant(args.mode)
    bar(0, 0, "loading")
    scene = None
    with warnings_as_ours(), Stop() as stop:
        for n, frame in enumerate(frames):
            # the scene before is held until the next is there, and with it its tables
            scene = load_scene(args.scene, frame.values)
            sensor = sensor_of(scene, args.sensor)
            if args.preview:
                shrink(sensor)
            spp = args.spp or preview_samples(sensor, args.preview)

            def progress(done: int, total: int, text: str, n: int = n) -> None:
                bar(n * total + done, len(frames) * total, f"frame {n + 1} of {len(frames)}")

            result = render_passes(
                scene, sensor, spp=spp, seed=frame.settings["seed"], variant=variant, stop=stop,
                progress=progress,
            )  # fmt: skip
            if result.interrupted and result.spp < spp:
                return
            colours = colours_of(result.bitmap)
            if colours is None:
                raise DiffractionError(
                    f"the film of '{args.scene}' holds no colours that a PNG could show; render "
                    "its frames one by one, to EXR"
                )
            bad = count_bad(result.bitmap)
            if bad:
                say_warning(f"{frame.png}: {bad} pixels are not finite and black")
            frame.png.parent.mkdir(parents=True, exist_ok=True)  # not for a scene that fails
            if args.exr:
                write_exr(result.bitmap, frame.exr, {"scene": str(args.scene), "variant": variant})
            # the PNG says that the frame is done
            write_png(colours, frame.png, args.exposure, {_KEY: json.dumps(frame.settings)})
            yield frame
            if stop.asked:
                return


def write_film(frames: list[Path], film: Path, fps: float) -> None:
    """Join PNG files to an endless film, by the suffix an animated WebP or GIF.

    Raises
    ------
    DiffractionError
        If Pillow cannot write such a file.
    """
    from PIL import Image

    # not as open files, of which there may be too many
    pictures = [Image.open(io.BytesIO(path.read_bytes())) for path in frames]
    try:
        with atomic_path(film) as temporary:
            pictures[0].save(
                temporary, format=film.suffix[1:].upper(), save_all=True,
                append_images=pictures[1:], duration=round(1000 / fps), loop=0,
                **FILMS[film.suffix.lower()],
            )  # fmt: skip
    except (OSError, KeyError, ValueError) as error:
        raise DiffractionError(f"cannot write '{film}': {error}") from error
    finally:
        for picture in pictures:
            picture.close()


def _settings_in(png: Path) -> dict[str, Any] | None:
    """The settings that a frame was written with; None if it is none."""
    from PIL import Image

    try:
        with Image.open(png) as image:
            text = getattr(image, "text", {}).get(_KEY, "")
        found = json.loads(text[1:-1])  # Mitsuba puts it into quotes
    except (OSError, ValueError, SyntaxError):
        return None
    return found if isinstance(found, dict) else None


def _digest(scene: Path, given: Mapping[str, str]) -> str:
    """Changes when the scene, what it includes, or a file that it names does."""
    content = hashlib.sha256()
    for file in files_of(scene, given):
        content.update(file.name.encode())
        content.update(file.read_bytes())
    return content.hexdigest()[:32]
