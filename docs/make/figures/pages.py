"""Shared functions of the programs of this folder: parts of pages, JPEG, measurements, errors.

Generated parts of Markdown files stand between `<!-- begin NAME -->` and its end, on lines of their
own or within a sentence. Files that are missing, damaged or not writable are a DiffractionError,
which a `program` prints in one line.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

from PIL import Image

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.cli import main as command
from mitsuba_diffraction.errors import DiffractionError

if TYPE_CHECKING:  # Matplotlib would be a part of what the bench measures
    from matplotlib.figure import Figure

Made = TypeVar("Made")
Option: TypeAlias = tuple[tuple[str, ...], dict[str, Any]]
Main: TypeAlias = Callable[..., int]

# JPEG's default blurs single sparkling pixels; at 90 they stay, in a quarter of a PNG's size.
_QUALITIES = (90, 86, 82, 78, 74, 70, 64, 58)


class Seconds(NamedTuple):
    """Time of some work in seconds: of the clock, and of processors."""

    clock: float
    processor: float


def replaced(text: str, name: str, content: str) -> str:
    """Return the text with the part of that name replaced between its markers."""
    head, old, tail = _split(text, name)
    around = "\n" if old.startswith("\n") else ""  # else the part is within a sentence
    return f"{head}{around}{content.strip()}{around}{tail}"


def part(text: str, name: str) -> str:
    """Return the text between the markers of that name."""
    return _split(text, name)[1].strip()


def _split(text: str, name: str) -> tuple[str, str, str]:
    """Return what stands before, between and after the markers of that name, with the markers."""
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise DiffractionError(f"expected '{begin}' and then '{end}', once each")
    first, last = text.index(begin) + len(begin), text.index(end)
    return text[:first], text[first:last], text[last:]


def update(path: str | os.PathLike[str], parts: Mapping[str, str]) -> None:
    """Replace parts of a file by name."""
    file = Path(path)
    text = _read(file)
    for name, content in parts.items():
        try:
            text = replaced(text, name, content)
        except DiffractionError as error:
            raise DiffractionError(f"'{file}': {error}") from error
    write_text(file, text)


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise DiffractionError(f"cannot read '{file}': {error.strerror}") from error


def table(header: Sequence[str], rows: Sequence[Sequence[object]], *, right: bool = False) -> str:
    """A Markdown table; `right` aligns all columns but the first to the right."""
    head, *body = ("| " + " | ".join(map(str, row)) + " |" for row in (header, *rows))
    rule = "| --- |" + " ---: |" * (len(header) - 1) if right else "|" + "---|" * len(header)
    return "\n".join([head, rule, *body])


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_figure(
    path: Path, figure: Figure, dpi: float | None = None, *, most: int | None = None
) -> None:
    """Write a figure as JPEG or PNG, without the name of its software: equal figures, equal files.

    dpi : of the picture; None is that of the figure.
    most : bytes of a JPEG, as in `write_jpeg`.
    """
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=dpi or "figure", metadata={"Software": None})
    if path.suffix == ".jpg":
        write_jpeg(picture, path, most=most)
        return
    with atomic_path(path) as temporary:
        temporary.write_bytes(picture.getvalue())


def run(*words: object) -> None:
    """Run a command of the package and say nothing, since it would name temporary files.

    Raises
    ------
    DiffractionError
        If the command fails, after its own message.
    """
    typed = [str(word) for word in words]
    with contextlib.redirect_stdout(io.StringIO()):
        code = command(typed)
    if code != 0:
        raise DiffractionError(f"'{' '.join(typed)}' failed; see above")


def timed(words: Sequence[object], **environment: str) -> tuple[Seconds, int]:
    """Run a command of the package in a process of its own, whose output is not shown.

    Returns
    -------
    Its time with that of its own processes, and its largest resident memory in bytes.
    """
    command = [sys.executable, "-m", "mitsuba_diffraction", *map(str, words)]
    start = time.perf_counter()
    process = subprocess.Popen(command, env=os.environ | environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise DiffractionError(f"'{' '.join(command[2:])}' failed; see above")
    seconds = Seconds(time.perf_counter() - start, used.ru_utime + used.ru_stime)
    return seconds, 1024 * used.ru_maxrss


def write_jpeg(
    source: Path | io.BytesIO, target: Path, *, width: int | None = None, most: int | None = None
) -> None:
    """Write a picture as JPEG.

    Parameters
    ----------
    source : a picture that Pillow reads.
    target : the JPEG.
    width : of the result in pixels; None keeps it.
    most : size in bytes that is not exceeded, at the price of quality.
    """
    try:
        with Image.open(source) as opened:
            image = opened.convert("RGB")
        if width is not None:
            size = (width, round(width * image.height / image.width))
            image = image.resize(size, Image.Resampling.LANCZOS)
        for quality in _QUALITIES:
            buffer = io.BytesIO()
            image.save(buffer, format="JPEG", quality=quality, subsampling=0, optimize=True)
            if most is None or buffer.tell() <= most:
                break
        else:
            raise DiffractionError(
                f"'{target}' would have {buffer.tell()} bytes, more than {most}; render it smaller "
                "or with more samples"
            )
        with atomic_path(target) as path:
            path.write_bytes(buffer.getvalue())
    except OSError as error:
        raise DiffractionError(f"cannot make '{target}' of '{source}': {error}") from error


def option(*names: str, **how: Any) -> Option:
    """Return an option of a program, as `argparse` declares it."""
    return names, how


def progress_option() -> Option:
    """Return the option of programs with a progress bar."""
    return option(
        "--progress", action=argparse.BooleanOptionalAction, default=None,
        help="show progress bars; by default on a terminal",
    )  # fmt: skip


def measured_options(what: str) -> tuple[Option, ...]:
    """Return the options that name a measured patch; `what` is the help of the first."""
    lengths = (("--pixel-size", "DX"), ("--max-height", "H"))
    return (
        option("--measured", metavar="FILE", help=what),
        *(option(n, metavar=m, help="of the measured patch, µm") for n, m in lengths),
    )


def program(*options: Option) -> Callable[[Callable[[argparse.Namespace], None]], Main]:
    """Return a decorator that makes a function of parsed options the `main` of its module.

    That returns 0, 130 if it was interrupted, or 1 after an error, which is printed in one line.
    Its help is the module's. A module that is run as a program exits with it here: it has to be the
    module's last function.
    """

    def made(work: Callable[[argparse.Namespace], None]) -> Main:
        def main(argv: Sequence[str] | None = None) -> int:
            module = sys.modules[work.__module__]
            name = module.__spec__.name if module.__spec__ else work.__module__
            name = name.removesuffix(".__main__")
            parser = argparse.ArgumentParser(
                prog=f"python -m {name}", description=str(module.__doc__).split("\n")[0]
            )
            for names, how in options:
                parser.add_argument(*names, **how)
            args = parser.parse_args(argv)
            try:
                work(args)
            except DiffractionError as error:
                print(f"{name.rpartition('.')[2]}: error: {error}", file=sys.stderr)
                return 1
            except KeyboardInterrupt:
                print("interrupted; no half-written file was left behind", file=sys.stderr)
                return 130
            return 0

        if work.__module__ == "__main__":
            sys.exit(main())
        return main

    return made


def measured_patch(args: argparse.Namespace) -> HeightField | None:
    """Return the patch that these options name, or None."""
    if args.measured is None:
        return None
    return HeightField.load(args.measured, pixel_size=args.pixel_size, max_height=args.max_height)


def from_json(file: Path, make: Callable[[Any], Made], *, writer: str, remedy: str) -> Made:
    """Read a measurement in JSON.

    Parameters
    ----------
    make : converts the document; it fails if the document is of another kind.
    writer, remedy : the command that writes such files, and what to do if this is another file.
    """
    try:
        return make(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, LookupError, TypeError, StopIteration) as error:
        raise DiffractionError(
            f"'{file}' is not what {writer} writes ({error}); {remedy}"
        ) from error
