"""Pictures of docs/gallery.md and docs/meshes.md, each with the commands that make it.

    python -m docs.make.figures.gallery -o docs [--only cd]

`markdown` writes the parts of the pages between their markers; a test compares them.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import shlex
import shutil
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.cli import main as run_command
from mitsuba_diffraction.errors import DiffractionError
from scenes.make.__main__ import main as meshes

from . import pages
from .pages import option, program, write_jpeg

FOLDER = Path("images", "gallery")  # beside the pages
_MOST = 250_000  # bytes of a picture
_PROGRAM = ".venv/bin/mitsuba-diffraction"
_MESHES = ".venv/bin/python -m scenes.make"


@dataclass(frozen=True)
class Picture:
    """A picture of a page."""

    page: str  # name of the page and of its markers
    name: str  # name of the picture's file
    title: str
    text: str
    commands: tuple[str, ...]  # files are written to `out`; the last command writes the picture

    @property
    def file(self) -> Path:
        """Path of the picture, relative to the page."""
        film = self.commands[-1].endswith(".webp")
        return FOLDER / f"{self.name}{'.webp' if film else '.jpg'}"


def _scene(name: str, title: str, text: str, options: str = "", scene: str = "") -> Picture:
    command = f"render scenes/{scene or name}.xml {options}".strip()
    return Picture("gallery", name, title, text, (f"{command} -o out/{name}.png",))


PICTURES = (
    _scene(
        "snake", "A corn snake",
        "A look-alike of *Elaphe guttata* in sun and clear sky.",
    ),
    _scene(
        "xenopeltis", "A sunbeam snake",
        "*Xenopeltis unicolor* under a window, whose reflection covers the whole body.",
    ),
    _scene(
        "xenopeltis_sun", "The sunbeam snake in the sun",
        "Under a small light, colours shrink to spots.",
        "-D light=daylight.xml", "xenopeltis",
    ),
    _scene(
        "snake_two", "A snake with two patches",
        "Rings with a wider period, by `diffraction_mix`.",
        "-D skin=skin_two.xml -D resx=480 -D resy=300 -s 64", "xenopeltis",
    ),
    Picture(
        "gallery", "turning", "The snake turns",
        "`--turn sun_azimuth` turns the light instead.",
        ("render scenes/snake.xml -D resx=240 -D resy=150 -s 24 --frames 16 --turn turn --fps 8 "
         "-o out/turning.webp",),
    ),
    _scene(
        "scales", "Some scales from close by",
        "Each scale shows the lamp's mirror image and, on both sides, the orders of its relief.",
    ),
    Picture(
        "gallery", "scales_macro", "The grain of a scale",
        "Speckle under a lamp that moves by 2° (`coherence=surface`).",
        ("render scenes/scales_macro.xml -D resx=300 -D resy=200 -s 48 --frames 10 "
         "--animate lamp_azimuth=112:114 --fps 8 -o out/scales_macro.webp",),
    ),
    _scene(
        "cd", "A compact disc under a lamp",
        "[Solved orders](orders.md), denoised.",
        "--denoise",
    ),
    _scene(
        "cd_window", "The disc under a window",
        "Each pane has a spectrum of its own.",
    ),
    _scene(
        "grating", "A blazed grating under a lamp",
        "600 lines per millimetre, with solved orders.",
    ),
    _scene(
        "grating_window", "The grating under a window",
        "The spectra of the panes overlap.",
    ),
    _scene(
        "hologram", "A hologram on a box",
        "Each area is a grating of its own; see [holograms](holograms.md).",
    ),
    _scene(
        "film", "A diffraction film before lamps",
        "A thin sheet (`diffraction_dielectric`).",
    ),
    _scene(
        "orders_on_wall", "Orders on a wall",
        "The blazed grating in a narrow beam. [A file of efficiencies]"
        "(orders.md#efficiencies-from-another-program-or-measured) can replace it.",
    ),
    _scene(
        "laser_through_plate", "A laser through a plate",
        "The back is a [block](orders.md#blocks) with a period of 1 µm.",
    ),
    _scene(
        "spectrometer", "A grating spectrometer",
        "Slit, clear grating and screen, traced from the lamp; see "
        "[thin sheets](orders.md#thin-sheets).",
    ),
    _scene(
        "material_ball", "A ball of any material",
        "Your own patch and metal: `-D patch=\"$PWD/scale.exr\" -D material=Cr`.",
    ),
    _scene(
        "material_ball_cd", "The tracks of a CD on gold",
        "Another patch and metal in this scene.",
        "-D patch=../precompute/cd.toml -D material=Au", "material_ball",
    ),
    _scene(
        "own_mesh", "A mesh of your own",
        "See [meshes](meshes.md).",
    ),
    _scene(
        "plate", "A flat sample",
        "Five centimetres of the corn snake's relief.",
    ),
    _scene(
        "sphere", "A ball in the sun",
        "The corn snake's relief on dark material.",
    ),
    Picture(
        "meshes", "snake_short", "",
        "A short, thick snake with few large and strongly keeled scales that overlap far:",
        ("meshes snake -o out/short.ply --eyes out/short_eyes.ply --length 64 --girth-radius 2.1 "
         "--coils 0.9 --rows 13 --keel 1 --relief 0.1 --overlap 0.35 --aspect 1.4",
         "render scenes/snake.xml -D mesh=$PWD/out/short.ply -D eyes=$PWD/out/short_eyes.ply "
         "-D pigment_scale=0.124569 -D fov=40 -D resx=480 -D resy=300 -s 48 "
         "-o out/snake_short.png"),
    ),
    Picture(
        "meshes", "snake_slender", "",
        "A slender snake with many small smooth scales:",
        ("meshes snake -o out/slender.ply --eyes out/slender_eyes.ply --length 150 "
         "--girth-radius 1.15 --coils 3.2 --rows 27 --keel 0 --relief 0.05 --overlap 0.15 "
         "--detail 3",
         "render scenes/snake.xml -D mesh=$PWD/out/slender.ply -D eyes=$PWD/out/slender_eyes.ply "
         "-D pigment_scale=0.030420 -D resx=480 -D resy=300 -s 48 -o out/snake_slender.png"),
    ),
    Picture(
        "meshes-field", "knot_field", "",
        "A closed tube in a knot, a mesh without texture coordinates:",
        ("meshes knot -o out/bare.ply",
         "tangents out/bare.ply -o out/knot.ply",
         "render scenes/own_mesh.xml -D mesh=$PWD/out/knot.ply -D resx=400 -D resy=360 -s 64 "
         "-o out/knot_field.png"),
    ),
)  # fmt: skip


def markdown(page: str) -> str:
    """Part of a page between its markers: pictures, texts and commands."""
    parts = []
    for picture in PICTURES:
        if picture.page != page:
            continue
        title = f"## {picture.title}\n\n" if picture.title else ""
        link = picture.file.as_posix()
        # a heading above the picture already describes it
        label = "" if picture.title else picture.text.rstrip(":")
        # a text that ends with a colon precedes its picture
        image = f"![{label}]({link})"
        scene = f"scenes/{picture.name}.xml"
        if picture.commands == (f"render {scene} -o out/{picture.name}.png",):
            # the head of the page has the command for a scene without options
            parts.append(f"{title}{image}\n\n{picture.text} [{scene}](../{scene})")
            continue
        inner = (picture.text, image)
        body = "\n\n".join(inner if picture.text.endswith(":") else inner[::-1])
        commands = "\n".join(as_typed(command) for command in picture.commands)
        parts.append(f"{title}{body}\n\n```sh\n{commands}\n```")
    return "\n\n".join(parts)


def as_typed(command: str) -> str:
    """Command with its program, in lines of at most 110 characters."""
    first, rest = command.split(" ", 1)
    line = f"{_MESHES} {rest}" if first == "meshes" else f"{_PROGRAM} {command}"
    if len(line) <= 110:
        return line
    lines, current = [], ""
    for word in line.split(" "):
        if current and len(current) + len(word) > 100 and word.startswith("-"):
            lines.append(current)
            current = "    "
        current += ("" if current.strip() == "" else " ") + word
    return " \\\n".join([*lines, current])


def make(picture: Picture, target: Path, scenes: Path) -> None:
    """Run the commands of a picture, and write it."""
    with tempfile.TemporaryDirectory() as temporary:
        for command in picture.commands:
            words = [
                _moved(word, Path(temporary), scenes)
                for word in shlex.split(command.replace("$PWD/", ""))
            ]
            with contextlib.redirect_stdout(io.StringIO()):  # it would name temporary files
                code = meshes(words[1:]) if words[0] == "meshes" else run_command(words)
            if code != 0:
                raise DiffractionError(f"{picture.name}: '{command}' failed; see above")
        rendered = Path(words[-1])
        if "--denoise" in words:
            rendered = rendered.with_stem(f"{rendered.stem}_denoised")
        if target.suffix == ".jpg":
            write_jpeg(rendered, target, most=_MOST)
            return
        if rendered.stat().st_size > _MOST:
            raise DiffractionError(f"{picture.name}: the film has {rendered.stat().st_size} bytes")
        with atomic_path(target) as path:
            shutil.copyfile(rendered, path)


def _moved(word: str, out: Path, scenes: Path) -> str:
    """Word of a command, with paths in the temporary folder and in the folder of the scenes."""
    head, equals, value = word.rpartition("=")
    if value.startswith("out/"):
        return f"{head}{equals}{out / value.removeprefix('out/')}"
    if value.startswith("scenes/"):
        return f"{head}{equals}{scenes / value.removeprefix('scenes/')}"
    return word


@program(
    option("-o", "--output", type=Path, default=Path("docs"), help="of the pages"),
    option("--scenes", type=Path, default=Path("scenes")),
    option(
        "--only", metavar="NAME", action="append", choices=[p.name for p in PICTURES],
        help="make one picture; may be given several times",
    ),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Make the pictures and write the pages."""
    (args.output / FOLDER).mkdir(parents=True, exist_ok=True)
    for picture in PICTURES:
        if args.only is None or picture.name in args.only:
            start = time.perf_counter()
            make(picture, args.output / picture.file, args.scenes)
            print(f"{picture.name}: {time.perf_counter() - start:.1f} s", flush=True)
    pages.update(args.output / "gallery.md", {"gallery": markdown("gallery")})
    parts = {name: markdown(name) for name in ("meshes", "meshes-field")}
    pages.update(args.output / "meshes.md", parts)
