"""Write the meshes and textures of the scenes, or a snake of one's own."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..errors import DiffractionError
from ..files.atomic import atomic_path
from . import pigment
from .anatomy import Anatomy
from .scales import Scales
from .snake import Snake, build
from .trimesh import write_ply

SCENES = Path(__file__).resolve().parents[2] / "scenes"
UNITS = "lengths in cm, z up"


def elaphe() -> Snake:
    """A corn snake: slender, with keeled scales in fewer and wider rows than the real 27."""
    return build(Anatomy(), Scales())


def xenopeltis() -> Snake:
    """A sunbeam snake: a thick neck and tail, a small head, fifteen rows of smooth scales."""
    anatomy = Anatomy(length=112, girth_radius=1.5306, taper=0.8, head=2.3)
    scales = Scales(rows=15, aspect=1.15, relief=0.07, keel=0.0, roundness=0.2, irregularity=2.5)
    return build(anatomy, scales, coils=2.2)


def write_scenes(folder: Path) -> None:
    """Write everything that `scenes/*.xml` refer to."""
    iris = {"elaphe": np.array([0.62, 0.27, 0.07]), "xenopeltis": np.array([0.24, 0.17, 0.12])}
    for name, make, paint in (
        ("elaphe", elaphe, pigment.corn_snake),
        ("xenopeltis", xenopeltis, pigment.sunbeam_snake),
    ):
        snake = make()
        comment = f"{name}, made by python -m mitsuba_diffraction.meshes scenes; {UNITS}"
        write_ply(folder / "meshes" / f"{name}.ply", snake.body, comment)
        write_ply(folder / "meshes" / f"{name}_eyes.ply", snake.eyes, comment)
        _write_png(folder / "textures" / f"{name}.png", paint(snake))
        _write_png(folder / "textures" / f"{name}_eye.png", pigment.eye(iris[name]))
    _write_png(folder / "textures" / "stone.png", pigment.stone())


def write_snake(options: dict[str, Any]) -> None:
    """Write the snake that the options of the command line describe."""

    def chosen(part: type[Anatomy] | type[Scales]) -> dict[str, Any]:
        return {f.name: options[f.name] for f in dataclasses.fields(part) if f.init}

    pose = {name: options[name] for name in ("coils", "squeeze", "heading", "head_detail")}
    snake = build(Anatomy(**chosen(Anatomy)), Scales(**chosen(Scales)), **pose)
    write_ply(options["output"], snake.body, UNITS)
    if options["eyes"]:
        write_ply(options["eyes"], snake.eyes, UNITS)
    print(
        f"{options['output']}: {len(snake.body.positions)} vertices, {len(snake.body.faces)} "
        f"triangles, u from 0 to {snake.skin.u_max:.3f} (pigment_scale={1 / snake.skin.u_max:.6f})"
    )


def _write_png(path: Path, colours: NDArray[np.float64]) -> None:
    with atomic_path(path) as temporary:
        Image.fromarray(np.round(colours * 255).astype(np.uint8)).save(temporary, optimize=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m mitsuba_diffraction.meshes", description=__doc__
    )
    commands = parser.add_subparsers(dest="command", required=True)
    shows_defaults = argparse.ArgumentDefaultsHelpFormatter
    scenes = commands.add_parser(
        "scenes", help="all meshes and textures of the scenes", formatter_class=shows_defaults
    )
    scenes.add_argument("-o", "--output", type=Path, default=SCENES, help="folder of the scenes")
    snake = commands.add_parser(
        "snake",
        help="a coiled snake as PLY, with normals and texture coordinates",
        description="Lengths in cm. Anatomy and Scales describe their parameters.",
        formatter_class=shows_defaults,
    )
    snake.add_argument("-o", "--output", type=Path, required=True, help="PLY file of the body")
    snake.add_argument("--eyes", type=Path, help="PLY file of the two eyes")
    snake.add_argument("--coils", type=float, default=2.35, help="turns of the coil")
    snake.add_argument("--squeeze", type=float, default=0.82, help="distance of loops in widths")
    snake.add_argument("--heading", type=float, default=-75.0, help="of the head; degrees from +x")
    snake.add_argument("--head-detail", type=int, default=72, help="rows of cells on the head")
    for part in (Anatomy, Scales):
        for field in dataclasses.fields(part):
            if field.init:
                kind = int if field.type == "int" else float
                name = "--" + field.name.replace("_", "-")
                snake.add_argument(name, type=kind, default=field.default, help=part.__name__)
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    options = vars(_parser().parse_args(arguments))
    try:
        if options["command"] == "scenes":
            write_scenes(options["output"])
        else:
            write_snake(options)
    except DiffractionError as error:
        print(f"mitsuba_diffraction.meshes: error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
