"""Frames of an animation, in files that a later run with the same settings keeps."""

from __future__ import annotations

import errno
import io
import itertools
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..atomic import atomic_path, make_folder
from ..errors import DiffractionError, counted, warn
from ..extras import optional
from ..files import refuse_pipe
from ..images import open_image
from ..progress import Progress
from .denoise import denoised
from .load import check_values, load_scene, preview_samples, sensor_of
from .passes import Stop, render_passes
from .pictures import colours_of, count_bad, write_exr, write_png

#: Suffixes of films, and the options with which Pillow writes them; `.mp4` is written by ffmpeg.
FILMS: dict[str, dict[str, Any]] = {
    ".webp": {"quality": 85, "method": 4},
    ".gif": {"optimize": True},
    ".mp4": {},
}
#: Why a frame that is not there is rendered.
MISSING = ("", "")
_KEY = "mitsuba-diffraction"  # key of the text in a frame's PNG


@dataclass(frozen=True)
class Frame:
    """A frame: its file, the scene's parameters, and the settings that decide its pixels."""

    png: Path
    values: dict[str, str]
    settings: dict[str, Any]

    @property
    def exr(self) -> Path:
        """Linear picture beside the PNG."""
        return self.png.with_suffix(".exr")

    def outdated(self, with_exr: bool) -> tuple[str, str] | None:
        """Return the reason to render the frame and an example; None if the file is this frame.

        Raises a DiffractionError if the file there is something else.
        """
        if not self.png.exists():
            return MISSING
        refuse_pipe(self.png)
        before = _settings_in(self.png)
        if before is None:
            raise DiffractionError(
                f"'{self.png}' exists and is not a frame of this command; name another folder by -o"
            )
        for name in {**before, **self.settings}:
            old, new = before.get(name), self.settings.get(name)
            if old != new:
                return name, "it changed" if name == "scene" else f"it was {old} and is {new}"
        return ("EXR", "it is missing") if with_exr and not self.exr.exists() else None


def check_frames(scene: Path, frames: Sequence[Frame]) -> None:
    """Refuse values of later frames before the first is rendered, in the variant that is set.

    The scene is parsed with the values of each frame, and loaded with the values of the last frame:
    allowed values are intervals, which hold all values between any two allowed ones.

    Raises a DiffractionError that names the frame.
    """
    for frame in frames[1:]:
        try:
            if frame is frames[-1]:
                load_scene(scene, frame.values)
            else:
                check_values(scene, frame.values)
        except DiffractionError as error:
            load_scene(scene, frames[0].values)  # its own error, if it is that of all frames
            raise DiffractionError(f"{frame.png.stem}: {error}") from error


def render_frames(
    scene: Path,
    frames: Sequence[Frame],
    *,
    with_exr: bool,
    progress: Progress,
    say: Callable[[str], None] | None = None,
) -> Iterator[Frame]:
    """Render and write frame after frame, in the variant that is set; ends early after Ctrl-C.

    frames : settings hold `samples` (a number, or a text for the scene's own), `seed`, `sensor`,
        `exposure`, `view`, `preview` and `denoise`.
    with_exr : write a linear EXR beside each PNG.
    progress : called as progress(samples done, samples in all, text).
    say : called with each change of surfaces of the first frame, see `load_scene`.

    Raises a DiffractionError if the scene fails, or its film holds no colours.
    """
    loaded = None
    with Stop() as stop:
        for n, frame in enumerate(frames):
            settings = frame.settings
            # the scene before is held until the next is there, and with it its tables
            loaded = load_scene(
                scene, frame.values, box_filter=settings["denoise"], say=None if n else say
            )
            sensor = sensor_of(loaded, settings["sensor"], settings["preview"])
            spp = settings["samples"]
            if not isinstance(spp, int):
                spp = preview_samples(sensor, settings["preview"])

            def tell(done: int, total: int, text: str, n: int = n) -> None:
                progress(n * total + done, len(frames) * total, f"frame {n + 1} of {len(frames)}")

            result = render_passes(
                loaded, sensor, spp=spp, seed=settings["seed"], stop=stop,
                progress=tell,
            )  # fmt: skip
            if result.interrupted and result.spp < spp:
                return
            picture = result.bitmap
            if settings["denoise"]:
                picture = denoised(loaded, sensor, picture, result.spp, settings["seed"])
            write_frame(frame, picture, scene, with_exr)
            yield frame
            if stop.asked:
                return


def write_frame(frame: Frame, bitmap: Any, scene: Path, with_exr: bool) -> None:
    """Write a frame's files.

    Raises a DiffractionError if its film holds no colours.
    """
    colours = colours_of(bitmap)
    if colours is None:
        raise DiffractionError(
            f"the film of '{scene}' holds no colours that a PNG could show; render its frames one "
            "by one, to EXR"
        )
    bad = count_bad(bitmap)
    if bad:
        warn(f"{frame.png}: {counted(bad, 'pixel')} not finite, and black")
    make_folder(frame.png.parent)  # not for a scene that fails
    if with_exr:
        write_exr(bitmap, frame.exr, {"scene": str(scene), "variant": str(mi.variant())})
    # the PNG marks the frame as done
    exposure, view = frame.settings["exposure"], frame.settings["view"]
    write_png(colours, frame.png, exposure, view, {_KEY: json.dumps(frame.settings)})


def write_film(frames: Sequence[Path], film: Path, fps: float) -> None:
    """Join PNG files to a film by its suffix: an endless WebP or GIF, or an MP4 (H.264).

    Raises a DiffractionError if the film cannot be written.
    """
    if film.suffix.lower() == ".mp4":
        _write_mp4(frames, film, fps)
        return
    # a frame ends at a whole unit, ms, so that frames of several lengths keep the rate
    unit = 10 if film.suffix.lower() == ".gif" else 1
    ends = [unit * round(1000 * n / (fps * unit)) for n in range(len(frames) + 1)]
    # not as open files, of which there may be too many
    pictures = [open_image(io.BytesIO(path.read_bytes()), ("PNG",)) for path in frames]
    try:
        with atomic_path(film) as temporary:
            pictures[0].save(
                temporary, format=film.suffix[1:].upper(), save_all=True,
                append_images=pictures[1:], loop=0,
                duration=[end - start for start, end in itertools.pairwise(ends)],
                **FILMS[film.suffix.lower()],
            )  # fmt: skip
    except (OSError, KeyError, ValueError) as error:
        raise DiffractionError(f"cannot write '{film}': {error}") from error
    finally:
        for picture in pictures:
            picture.close()


def check_film(film: Path) -> None:
    """Raise a DiffractionError if what writes films of this format is not installed."""
    if film.suffix.lower() == ".mp4":
        optional("imageio_ffmpeg")


def _write_mp4(frames: Sequence[Path], film: Path, fps: float) -> None:
    """Join PNG files to an MP4; pictures of odd size lose a row or a column, as H.264 requires."""
    ffmpeg = optional("imageio_ffmpeg")
    with open_image(frames[0], ("PNG",)) as first:
        width, height = (max(2, length - length % 2) for length in first.size)
    # matrix and tags of sRGB's primaries, without which players guess by the size of the picture
    colours = ["-vf", "scale=out_color_matrix=bt709", "-colorspace", "bt709"]
    colours += ["-color_primaries", "bt709", "-color_trc", "iec61966-2-1"]
    try:
        with atomic_path(film) as temporary:
            writer = ffmpeg.write_frames(
                str(temporary), (width, height), fps=fps, macro_block_size=2, quality=None,
                output_params=[*colours, "-crf", "16", "-f", "mp4"], ffmpeg_log_level="error",
            )  # fmt: skip
            writer.send(None)
            for path in frames:
                with open_image(path, ("PNG",)) as picture:
                    writer.send(picture.convert("RGB").crop((0, 0, width, height)).tobytes())
            writer.close()
            # it loses the error of a full disk
            written, _ = ffmpeg.count_frames_and_secs(str(temporary))
            if written != len(frames):
                raise OSError(
                    errno.ENOSPC, f"it has {written} of {len(frames)} frames; is the disk full?"
                )
    except (OSError, RuntimeError) as error:
        raise DiffractionError(f"cannot write '{film}': {error}") from error


def _settings_in(png: Path) -> dict[str, Any] | None:
    """Read the settings that a frame was written with; None for files of another kind."""
    try:
        with open_image(png, ("PNG",)) as image:
            text = getattr(image, "text", {}).get(_KEY, "")
        settings = json.loads(text[1:-1])  # Mitsuba puts it into quotes
    except (OSError, ValueError, SyntaxError):
        return None
    return settings if isinstance(settings, dict) else None
