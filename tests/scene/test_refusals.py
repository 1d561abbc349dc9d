"""What the room of scenes refuses, in one line that says what is wrong. A refusal is one row."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.scene import label
from mitsuba_diffraction.scene.bands import SensorBands
from mitsuba_diffraction.scene.fitted_mesh import fit_of
from mitsuba_diffraction.scene.frames import Frame
from mitsuba_diffraction.scene.logo import areas
from mitsuba_diffraction.scene.orientation.directions import direction_field
from mitsuba_diffraction.scene.orientation.mesh_files import load_mesh
from mitsuba_diffraction.scene.orientation.trimesh import TriangleMesh, grid_faces
from mitsuba_diffraction.scene.parameters import scene_values
from scenes.make import disc, piece
from tests.support.logos import write_board
from tests.support.meshes import ball
from tests.support.refusals import file, refused
from tests.support.room import scene_file

LABELS = np.array([[0, 1, 2], [2, 1, 7]], np.uint8)
HOLOGRAM = {"image": LABELS, "periods": {1: 0.8, 2: 1.2}, "orientations": {1: 30, 2: -90, 7: 0}}
POINT = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    b"property float z\nend_header\n"
)
FACE = b"element face 1\nproperty list uchar int vertex_indices\nend_header"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
BALL, GRID = ball(), grid_faces(np.arange(9).reshape(3, 3))
UNFINISHED = "which Mitsuba does not read; export it again"


def hologram(**change: Any) -> object:
    return md.hologram(**HOLOGRAM | change)


def picture(mode: str, colour: Any = None) -> Path:
    """A picture of one colour."""
    Image.new(mode, (9, 9), colour or 0).save("picture.png")
    return Path("picture.png")


def fitted(positions: np.ndarray, *up: str) -> object:
    """Put a mesh of these vertices on the stage."""
    normals, faces = np.tile([0.0, 0.0, 1.0], (len(positions), 1)), np.array([[0, 1, 2]])
    return fit_of(TriangleMesh(positions, normals, None, faces), Path("a.obj"), *up)


def mesh_of(name: str, content: str | bytes, needs: str = "") -> object:
    """Load a mesh file of this content, if the package that reads it is there."""
    if needs:
        pytest.importorskip(needs)
    return load_mesh(file(name, content))


def with_arrays(uv: int = 9, shift: int = 0, corners: int = 3) -> object:
    zeros = np.zeros((9, 3))
    return TriangleMesh(zeros, zeros, np.zeros((uv, 2)), GRID[:, :corners] + shift)


def labelled(change: Callable[[str], str]) -> object:
    """Put a label on the front of a board whose text is changed."""
    write_board(Path("board.obj"))
    board = file("board.obj", change(Path("board.obj").read_text()))
    return label.front(board, 1.0, width=0.5, height=0.5, up="z")


def inwards(text: str) -> str:
    lines = [line.split() for line in text.splitlines()]
    return "\n".join(" ".join([a, *rest[::-1]] if a == "f" else [a, *rest]) for a, *rest in lines)


def field_with(index: int, value: float) -> object:
    positions, normals, faces = BALL
    positions = positions.copy()
    positions[index] = value
    return direction_field(positions, normals, faces)


#: What is asked for, and words of the line.
REFUSED: list[tuple[Callable[[], object], str]] = [
    # holograms and logos
    (lambda: hologram(periods={1: 0.01}), "periods=0.01 must be between"),
    (lambda: hologram(periods={5: 1.0}), "no dot has a grating"),
    (lambda: hologram(periods={1: np.nan}), "periods: nan must be a finite number"),
    (lambda: hologram(periods=(0.8, 1.2)), "both be of labels"),
    (lambda: hologram(periods="wide"), "must be a mapping from labels, a pair"),
    (lambda: hologram(periods=np.ones((3, 3))), r"an array \(2, 3\)"),
    (lambda: hologram(orientations=np.inf), "orientations: inf must be a finite number"),
    (lambda: hologram(period=-1.0), "period=-1 must be between"),
    (lambda: hologram(dot=0), "dot=0 must be a whole number"),
    (lambda: hologram(image=np.zeros((2, 3, 3), np.uint8)), r"expected an array \(ny, nx\)"),
    (lambda: hologram(image=np.full((2, 3), 1.5)), "brightness must be between 0 and 1"),
    (lambda: hologram(image="missing.png"), "missing.png"),
    (lambda: hologram(image=picture("RGB"), periods=1.0, orientations=0.0), "save it in grey"),
    (lambda: areas(picture("RGB", "red")), "no colour beside its ground"),
    (lambda: areas(picture("RGBA", (0, 0, 0, 255))), "no colour beside its ground"),
    (lambda: areas(picture("RGBA", (255, 0, 0, 0))), "transparent everywhere"),
    (lambda: areas(file("a.png", "no picture")), "cannot be read as a picture"),
    # meshes on the stage, and labels
    (lambda: fitted(np.zeros((4, 3))), "on a line"),
    (lambda: fitted(np.outer(range(4), [1.0, 0.0, 2.0])), "on a line"),
    (lambda: fitted(np.where(np.eye(4, 3), np.nan, 1.0)), "vertex 0 is not finite"),
    (lambda: fitted(np.eye(4, 3), "up"), "choose one of"),
    (lambda: labelled(inwards), "normals point inwards"),
    (lambda: labelled(lambda text: text.replace("vt 1.0", "vt 0.0")), "no area in the label's mid"),
    (lambda: label.geometry(np.full(3, 70.0)), "inclined by 70°"),
    # files of meshes
    (lambda: load_mesh(Path("mesh.ply")), "mesh.ply' does not exist"),
    (lambda: mesh_of("mesh.ply", "ply\nformat ascii 1.0\nend_header\n"), "it has no triangles"),
    (lambda: mesh_of("mesh.ply", POINT + bytes(12)), "it has no triangles"),
    (lambda: mesh_of("mesh.ply", POINT.replace(b"end_header", FACE) + bytes(12)
                     + b"\3" + bytes([9, 0, 0, 0] * 3)), "mesh.ply.* names vertex"),
    (lambda: mesh_of("mesh.stl", "solid"), "must end in .ply, .obj, .serialized"),
    (lambda: mesh_of("mesh.obj", "v 0 0 0\n"), "mesh.obj.*it has no triangles"),
    (lambda: mesh_of("bad.obj", f"{TRIANGLE}f 1 2 99\n"), "^mesh .bad.obj.: cannot .* vertex 99;"),
    (lambda: mesh_of("bad.obj", f"{TRIANGLE}f -3 -2 -1\n"), f"it names vertex -3, .* {UNFINISHED}"),
    (lambda: mesh_of("bad.glb", b"glTF\2\0\0\0\xff\0\0\0nothing", "trimesh"), "bad.glb"),
    (lambda: mesh_of("a.gltf", '{"asset": {"version": "2.0"}, "meshes": 3}', "trimesh"), "a.gltf"),
    (lambda: mesh_of("a.gltf", '{"asset": {"version": "2.0"}}', "trimesh"), "a.gltf"),
    (lambda: mesh_of("a.gltf", '{"asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin"}]}',
                     "trimesh"), "a.gltf"),
    (lambda: mesh_of("bad.usda", "#usda 1.0\n nothing", "pxr"), "bad.usda"),
    (lambda: mesh_of("bad.usdz", "PK nothing", "pxr"), "bad.usdz"),
    (lambda: mesh_of("empty.usda", "#usda 1.0\n", "pxr"), "empty.usda"),
    (lambda: with_arrays(uv=8), "'uv' has shape"),
    (lambda: with_arrays(shift=1), "outside 0 to 8"),
    (lambda: with_arrays(corners=2), "'faces' has shape"),
    # fields of directions
    (lambda: direction_field(*BALL, "w"), "along='w' is unknown; choose one of smooth, x"),
    (lambda: direction_field(*BALL, "x", smoothing=np.nan), "smoothing = nan is outside"),
    (lambda: direction_field(np.zeros((3, 3)), np.ones((3, 3)), np.array([[0, 1, 2]])),
     "no triangle has an area"),
    (lambda: field_with(7, np.inf), "vertex 7 is not finite"),
    (lambda: disc(3.0, 2.0), "disc: inner = 3 is outside"),
    (lambda: piece(rows=99), "piece: rows = 99 is outside 3 to 17"),
    # scenes and their pictures
    (lambda: scene_values(scene_file(Path()), {"spp": "1"}), "has no parameters"),
    (lambda: Frame(file("frame_0000.png", "no picture"), {}, {}).outdated(False), "not a frame of"),
    (lambda: SensorBands([400.0, 410.0], {"s": [0.0, 0.0]}).first, "no wavelength"),
]  # fmt: skip


@pytest.mark.parametrize(("ask", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_what_does_not_fit_is_refused(some_variant, tmp_path, monkeypatch, ask, words):
    monkeypatch.chdir(tmp_path)
    refused(ask, words)
