"""`mitsuba-diffraction tangents`: lay a patch smoothly over any mesh."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import counted
from . import options
from .console import Bar, say_warning
from .report import Figures, check_outputs
from .values import number_between, path_ending_in

if TYPE_CHECKING:
    from ..scene.orientation.tangents import TangentReport

_GUIDES = ("smooth", "x", "y", "z", "body")
_NAMED = 6  # singular points that are named


@options.command(
    "tangents", "give a mesh a smooth field of directions for its patch",
    "Write a mesh (PLY, OBJ, glTF, USD) as a PLY whose attribute vertex_orientation lays "
    "the patch's x axis along a smooth field of directions. Texture coordinates are kept; "
    "a mesh without them gets some that carry only the direction. On a closed surface that "
    "(a torus excepted) every field has singular points, around which the patch turns.",
    ("MESH", "mesh to read", Path),
    ("-o --output OUT", "PLY to write", path_ending_in(".ply"), None, {"required": True}),
    ("--along", "field of directions: smooth, turns least; x, y, z, an axis laid onto the "
     "surface; body, from end to end", _GUIDES, "smooth"),
    ("--rotate DEGREES", "angle from the field to the x axis, counter-clockwise from outside; "
     "-90 lays the y axis along the field",
     number_between(-360, 360), 0.0),
    ("--smoothing S", "distance within which the field may leave its guide to stay smooth, as "
     "share of the mesh's size", number_between(1e-4, 1), 0.03),
    options.json("quality of the field"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Write the mesh, say where its field is singular, and return the figures."""
    if args.along == "smooth":
        no_guide = ": has no effect without a guide; add --along x, y, z or body"
        options.refuse(args, ["smoothing"], no_guide)
    check_outputs([args.output])
    from ..scene.orientation.directions import direction_field
    from ..scene.orientation.mesh_files import load_mesh, write_ply
    from ..scene.orientation.tangents import check_tangents
    from ..scene.orientation.trimesh import oriented_mesh, turned

    with Bar(args) as bar:
        bar(0, 0, "reading")
        read = load_mesh(args.mesh)
        arrays = read.positions, read.normals, read.faces
        bar(0, 0, "solving for the field")
        field = direction_field(*arrays, args.along, smoothing=args.smoothing)
        angle = np.radians(args.rotate)
        turn = np.array([np.cos(angle), np.sin(angle)])
        directions = turned(field.directions, read.normals, turn)
        mesh = oriented_mesh(*arrays, directions, read.uv)
        bar(0, 0, "writing")
        write_ply(args.output, mesh, f"{args.mesh.name}, patch along {args.along}")
    print(
        f"{args.output}: {counted(len(mesh.faces), 'triangle')}, patch along {args.along}, "
        f"{'texture coordinates kept' if read.uv is not None else 'had no texture coordinates'}"
    )
    report = check_tangents(mesh)
    print(_places(field.singular, field.indices, report))
    print(
        'in the scene: <texture type="mesh_attribute" name="orientation"><string name="name" '
        'value="vertex_orientation"/></texture> within the diffraction BSDF'
    )
    for problem in report.problems():
        say_warning(problem)
    places = [{"at": at, "turns": n} for at, n in zip(field.singular, field.indices, strict=True)]
    return {"mesh": args.mesh, "files": [args.output], "along": args.along,
            "singular": places, "tangents": report}  # fmt: skip


def _places(places: object, indices: object, report: TangentReport) -> str:
    """Name the singular points in one line, or say that the field has none."""
    points, turns = np.asarray(places), np.asarray(indices)
    if not len(points):
        if report.broken > 0:
            return f"the field has no singular points, but {report.breaking()}"
        return "the field is smooth everywhere"
    named = [
        f"({', '.join(f'{value:.3g}' for value in point)}) {turn:+d}"
        for point, turn in zip(points[:_NAMED], turns, strict=False)
    ]
    more = f" and {len(points) - _NAMED} more" if len(points) > _NAMED else ""
    return (
        f"{counted(len(points), 'singular point')}, with the turns around each: "
        f"{', '.join(named)}{more}; together {turns.sum():+d}"
    )
