"""A logo with a letter, which no mirror and no turn maps onto itself, and meshes to put it on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from tests.support.meshes import obj_of, ply_text

#: Colours of the logo, most frequent first.
COLOURS = ((230, 60, 40), (250, 210, 40), (40, 80, 200))


def drawn(width: int, finer: int) -> Image.Image:
    """Return a shield with a disc and the letter F; antialiased if drawn finer than shown."""
    unit = width * finer / 64
    picture = Image.new("RGBA", (round(64 * unit), round(48 * unit)), (0, 0, 0, 0))
    pen = ImageDraw.Draw(picture)

    def box(*sides: float) -> tuple[float, ...]:
        x, y, right, bottom = (side * unit for side in sides)
        return x, y, right - 1, bottom - 1

    pen.rounded_rectangle(box(4, 4, 60, 44), 6 * unit, fill=COLOURS[0])
    pen.ellipse(box(8, 12, 32, 36), fill=COLOURS[1])
    for stroke in ((38, 10, 42, 38), (38, 10, 54, 15), (38, 20, 50, 25)):
        pen.rectangle(box(*stroke), fill=COLOURS[2])
    size = width, width * 3 // 4
    return picture.resize(size, Image.Resampling.BOX) if finer > 1 else picture


def write_board(file: Path, turn: int = 0, *, with_uv: bool = True) -> None:
    """Write a board of 64 × 8 × 48 mm, z up, whose front has the unit square of coordinates.

    turn : quarter turns of the texture coordinates.
    """
    x, y, z = 32.0, 4.0, 48.0
    corners = [(s * x + 500.0, t * y, h) for t in (-1, 1) for h in (0.0, z) for s in (-1, 1)]
    quads = ((0, 1, 3, 2), (5, 4, 6, 7), (4, 0, 2, 6), (1, 5, 7, 3), (2, 3, 7, 6), (4, 5, 1, 0))
    uv: NDArray[np.float64] = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    angle = np.pi / 2 * turn
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    front = (uv - 0.5) @ rotation.T + 0.5
    if file.suffix == ".obj":
        used = np.round([*front, *(uv * 0.1 + 7)], 6) if with_uv else ()
        obj_of(file, corners, quads, used, [range(4), *[range(4, 8)] * 5])
        return
    places = [front if n == 0 else uv * 0.1 + 7 for n in range(len(quads))]
    rows = [
        (*corners[v], *places[n][k]) for n, quad in enumerate(quads) for k, v in enumerate(quad)
    ]
    firsts = range(0, len(rows), 4)
    faces = [(a, a + k, a + k + 1) for a in firsts for k in (1, 2)]
    if file.suffix in (".glb", ".gltf"):
        trimesh = pytest.importorskip("trimesh")
        table = np.array(rows)
        visual = trimesh.visual.TextureVisuals(uv=table[:, 3:])
        mesh = trimesh.Trimesh(table[:, :3], faces, visual=visual, process=False)
        trimesh.Scene(mesh).export(file)
        return
    file.write_text(ply_text(rows, faces, "xyzst"))


RED = [0.8, 0.1, 0.1]


def write_boxes(file: Path, body: str = "Body", cap: str = "Cap") -> None:
    """A box of the material `body` below a smaller red metal one, `cap`."""
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    for name, side, height, colour in ((body, 2.0, 1.0, [1.0] * 4), (cap, 1.0, 2.5, [*RED, 1])):
        box = trimesh.creation.box([side, side, side])
        box.apply_translation([0.0, height, 0.0])
        material = trimesh.visual.material.PBRMaterial(
            name=name, baseColorFactor=colour, metallicFactor=0.75, roughnessFactor=0.25
        )
        uv = np.tile([0.25, 0.75], (len(box.vertices), 1))
        box.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        scene.add_geometry(box, node_name=f"node of {name}")
    scene.export(file)
