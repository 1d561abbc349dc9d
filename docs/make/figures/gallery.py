"""Pictures of docs/gallery.md and docs/meshes.md, made by the commands that stand below them.

    python -m docs.make.figures.gallery -o docs [--only cd]

Commands run in the current folder, the project's, as a reader types them.
"""

from __future__ import annotations

import argparse
import re
import shlex
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError
from scenes.make.__main__ import main as meshes

from .pages import option, program, run, write_jpeg

PAGES = ("gallery.md", "meshes.md")
_MOST = 250_000  # bytes of a picture
# a picture, and what stands below it: up to the next one or a heading
_PICTURE = re.compile(r"^!\[[^\]]*\]\((images/gallery/[^)]+)\)$(.*?)(?=^#|^!\[|\Z)", re.M | re.S)
_COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class Picture:
    """A picture of a page, and the words of its commands, of which the last writes it.

    file : relative to the page.
    """

    file: Path
    commands: tuple[tuple[str, ...], ...]


def pictures(page: str) -> Iterator[Picture]:
    """Yield the pictures of a page's text; one without commands shows the scene of its name."""
    for link, below in _PICTURE.findall(page):
        file = Path(link)
        plain = f"mitsuba-diffraction render scenes/{file.stem}.xml -o out/{file.stem}.png"
        block = _COMMANDS.search(below)
        typed = block[1].replace("\\\n", " ").replace("$PWD/", "") if block else plain
        yield Picture(file, tuple(tuple(shlex.split(line)) for line in typed.splitlines()))


def make(picture: Picture, target: Path) -> None:
    """Run the commands of a picture, and write it."""
    for program_, *words in picture.commands:
        Path(words[words.index("-o") + 1]).parent.mkdir(parents=True, exist_ok=True)
        if Path(program_).name == "mitsuba-diffraction":
            run(*words)
        elif meshes(words[2:]) != 0:  # python -m scenes.make
            raise DiffractionError(f"'{' '.join(words)}' failed; see above")
    rendered = Path(words[words.index("-o") + 1])
    if "--denoise" in words:
        rendered = rendered.with_stem(f"{rendered.stem}_denoised")
    if target.suffix == ".jpg":
        write_jpeg(rendered, target, most=_MOST)
        return
    if rendered.stat().st_size > _MOST:
        raise DiffractionError(f"'{rendered}': the film has {rendered.stat().st_size} bytes")
    with atomic_path(target) as path:
        shutil.copyfile(rendered, path)


@program(
    option("-o", "--output", type=Path, default=Path("docs"), help="of the pages"),
    option(
        "--only", metavar="NAME", action="append",
        help="make one picture; may be given several times",
    ),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Make the pictures."""
    texts = ((args.output / page).read_text(encoding="utf-8") for page in PAGES)
    shown = {picture.file.stem: picture for text in texts for picture in pictures(text)}
    if unknown := set(args.only or ()) - set(shown):
        raise DiffractionError(
            f"no picture {', '.join(sorted(unknown))}; choose from {', '.join(shown)}"
        )
    for name in args.only or shown:
        start = time.perf_counter()
        make(shown[name], args.output / shown[name].file)
        print(f"{name}: {time.perf_counter() - start:.1f} s", flush=True)
