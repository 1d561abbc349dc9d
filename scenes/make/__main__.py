"""Write a snake, a piece of its skin or a disc as PLY, or all that the scenes use.

Lengths in cm, z up. Every mesh has normals, texture coordinates whose u runs the way a measured
patch's x axis shall, and the attribute vertex_orientation, which turns the patch from there.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.scene.orientation import (
    TriangleMesh,
    direction_field,
    oriented_mesh,
    write_ply,
)

from . import pigment
from .anatomy import Anatomy
from .disc import disc
from .knot import knot
from .options import add_options_of, chosen
from .piece import piece
from .scales import Scales
from .snake import Snake, build
from .sticker import sticker

UNITS = "lengths in cm, z up"
#: Of the compact disc in `scenes/cd.xml`: name, inner and outer radius.
CD = (("hub", 0.75, 1.9), ("band", 1.9, 2.3), ("data", 2.3, 5.8), ("rim", 5.8, 6.0))
#: What `scenes/scales.xml` shows.
CLOSE_SCALES, CLOSE_COLUMNS, CLOSE_ROWS = Scales(rows=21, keel=0.35, detail=12), 6, 9


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
    meshes, textures = folder / "meshes", folder / "textures"
    iris = {"elaphe": np.array([0.62, 0.27, 0.07]), "xenopeltis": np.array([0.24, 0.17, 0.12])}
    for name, make, paint in (
        ("elaphe", elaphe, pigment.corn_snake),
        ("xenopeltis", xenopeltis, pigment.sunbeam_snake),
    ):
        snake = make()
        _write_scene_mesh(meshes / f"{name}.ply", snake.body)
        _write_scene_mesh(meshes / f"{name}_eyes.ply", snake.eyes)
        _write_png(textures / f"{name}.png", paint(snake))
        _write_png(textures / f"{name}_eye.png", pigment.eye(iris[name]))
    _write_png(textures / "stone.png", pigment.stone())
    _write_png(textures / "back.png", pigment.back())
    sticker().write(textures)
    _write_png(textures / "black.png", np.zeros((1, 1)))
    close = piece(scales=CLOSE_SCALES, columns=CLOSE_COLUMNS, rows=CLOSE_ROWS)
    _write_scene_mesh(meshes / "scales.ply", close)
    painted = pigment.corn_snake_piece(CLOSE_SCALES, CLOSE_COLUMNS, CLOSE_ROWS)
    _write_png(textures / "scales.png", painted)
    for name, inner, outer in CD:
        write_ply(meshes / f"cd_{name}.ply", disc(inner, outer), _comment(f"cd_{name}"))
    shape = knot()
    field = direction_field(*shape)
    write_ply(meshes / "knot.ply", oriented_mesh(*shape, field.directions), _comment("knot"))


def _write_scene_mesh(path: Path, mesh: TriangleMesh) -> None:
    """Without an orientation: the scenes of snakes turn the patch by one angle."""
    write_ply(path, replace(mesh, orientation=None), _comment(path.stem.removesuffix("_eyes")))


def _comment(name: str) -> str:
    return f"{name}, made by python -m scenes.make scenes; {UNITS}"


def write_snake(args: argparse.Namespace) -> None:
    """Write the snake that the options describe."""
    snake = build(
        chosen(Anatomy, args),
        chosen(Scales, args),
        coils=args.coils,
        squeeze=args.squeeze,
        heading=args.heading,
        head_detail=args.head_detail,
    )
    write_ply(args.output, snake.body, UNITS)
    if args.eyes:
        write_ply(args.eyes, snake.eyes, UNITS)
    u_max = snake.skin.u_max
    _report(args.output, snake.body, f"u from 0 to {u_max:.3f} (pigment_scale={1 / u_max:.6f})")


def write_piece(args: argparse.Namespace) -> None:
    """Write the piece of skin that the options describe."""
    mesh = piece(
        chosen(Anatomy, args), chosen(Scales, args), columns=args.columns, rows=args.scales_across
    )
    write_ply(args.output, mesh, UNITS)
    low, high = mesh.uv.min(axis=0), mesh.uv.max(axis=0)
    ranges = (f"{name} from {a:.4f} to {b:.4f}" for name, a, b in zip("uv", low, high, strict=True))
    _report(args.output, mesh, ", ".join(ranges))


def write_disc(args: argparse.Namespace) -> None:
    """Write the ring that the options describe."""
    mesh = disc(args.inner, args.outer, args.sectors)
    write_ply(args.output, mesh, UNITS)
    _report(args.output, mesh, "patch along the radius")


def write_knot(args: argparse.Namespace) -> None:
    """Write the knot, without texture coordinates."""
    positions, normals, faces = knot(args.along, args.around)
    mesh = TriangleMesh(positions, normals, None, faces)
    write_ply(args.output, mesh, UNITS)
    _report(args.output, mesh, "no texture coordinates")


def _report(path: Path, mesh: TriangleMesh, more: str) -> None:
    print(f"{path}: {len(mesh.positions)} vertices, {len(mesh.faces)} triangles, {more}")


def _write_png(path: Path, colours: NDArray[np.float64]) -> None:
    with atomic_path(path) as temporary:
        Image.fromarray(np.round(colours * 255).astype(np.uint8)).save(temporary, optimize=True)


def build_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m scenes.make", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name: str, about: str) -> argparse.ArgumentParser:
        return commands.add_parser(
            name, help=about, description=f"{about[0].upper()}{about[1:]}. Lengths in cm.",
            formatter_class=argparse.ArgumentDefaultsHelpFormatter,
        )  # fmt: skip

    scenes = command("scenes", "all meshes and textures of the scenes")
    scenes.add_argument("-o", "--output", type=Path, default=Path("scenes"),
                        help="folder of the scenes; default: scenes")  # fmt: skip
    scenes.set_defaults(write=lambda args: write_scenes(args.output))

    snake = command("snake", "a coiled snake")
    snake.add_argument("-o", "--output", type=Path, required=True, help="PLY file of the body")
    snake.add_argument("--eyes", type=Path, help="PLY file of the two eyes")
    pose = snake.add_argument_group("how it lies")
    pose.add_argument("--coils", type=float, default=2.35, help="turns of the coil; 0.5 to 20")
    pose.add_argument("--squeeze", type=float, default=0.82,
                      help="distance of neighbouring loops in body widths; 0.6 to 3")  # fmt: skip
    pose.add_argument("--heading", type=float, default=-75.0,
                      help="where the head points to; degrees from +x towards +y")  # fmt: skip
    pose.add_argument("--head-detail", type=int, default=72,
                      help="rows of cells on the head; 8 to 1000")  # fmt: skip
    snake.set_defaults(write=write_snake)

    part = command("piece", "some scales of a straight snake's back, for close views")
    part.add_argument("-o", "--output", type=Path, required=True, help="PLY file")
    part.add_argument("--columns", type=int, default=6, help="scales along the body; 2 to 40")
    part.add_argument("--scales-across", type=int, default=9,
                      help="scales across the back; 3 to the number of rows")  # fmt: skip
    part.set_defaults(write=write_piece)

    for subparser, detail in ((snake, 4), (part, 12)):
        add_options_of(Anatomy(), subparser.add_argument_group("anatomy"))
        add_options_of(Scales(detail=detail), subparser.add_argument_group("scales"))

    tied = command("knot", "a knot without texture coordinates, to try things on")
    tied.add_argument("-o", "--output", type=Path, required=True, help="PLY file")
    tied.add_argument("--along", type=int, default=160, help="quadrangles along; 24 to 10000")
    tied.add_argument("--around", type=int, default=18, help="quadrangles around; 3 to 1000")
    tied.set_defaults(write=write_knot)

    ring = command("disc", "a flat ring whose patch follows the radius")
    ring.add_argument("-o", "--output", type=Path, required=True, help="PLY file")
    ring.add_argument("--inner", type=float, default=2.3, help="radius; 0 makes no hole")
    ring.add_argument("--outer", type=float, default=5.8, help="radius; above the inner one")
    ring.add_argument("--sectors", type=int, default=240, help="quadrangles around; 12 to 10000")
    ring.set_defaults(write=write_disc)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    args = build_parser().parse_args(arguments)
    try:
        args.write(args)
    except DiffractionError as error:
        print(f"scenes.make: error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
