"""Mesh files are checked as Mitsuba reads them: good ones pass, and no index leads out of them."""

from __future__ import annotations

import itertools
import struct
import zlib
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.orientation.mesh_indices import check_mesh

POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
FACES = np.array([[0, 1, 2], [2, 1, 3]])
WRONG = np.array([[0, 1, 2], [2, 1, 4]])


def serialized(faces: np.ndarray, flags: int, version: int, count: int) -> bytes:
    """Return a file of Mitsuba's own format with `count` equal meshes."""
    number = "<f8" if flags & 0x2000 else "<f4"
    content = struct.pack("<I", flags) + (b"name\0" if version == 4 else b"")
    content += struct.pack("<QQ", len(POSITIONS), len(faces)) + POSITIONS.astype(number).tobytes()
    for flag, values in ((1, np.tile([0.0, 0.0, 1.0], (4, 1))), (2, POSITIONS[:, :2]),
                         (8, POSITIONS)):  # fmt: skip
        content += values.astype(number).tobytes() if flags & flag else b""
    mesh = struct.pack("<HH", 0x041C, version) + zlib.compress(
        content + faces.astype("<u4").tobytes()
    )
    code = "<Q" if version == 4 else "<I"
    places = b"".join(struct.pack(code, n * len(mesh)) for n in range(count))
    return mesh * count + places + struct.pack("<I", count)


@pytest.mark.parametrize("version", [3, 4])
@pytest.mark.parametrize("precision", [0x1000, 0x2000])
def test_serialized_meshes_are_read_as_mitsuba_reads_them(
    precision: int, version: int, tmp_path: Path, some_variant: str
) -> None:
    file = tmp_path / "mesh.serialized"
    for normals, uv, colours, number in itertools.product((0, 1), (0, 2), (0, 8), (0, 1)):
        flags = precision | normals | uv | colours
        file.write_bytes(serialized(FACES, flags, version, 2))
        mesh = mi.load_dict({"type": "serialized", "filename": str(file), "shape_index": number})
        check_mesh(file, "serialized", number)
        assert mesh.face_count() == 2
        file.write_bytes(serialized(WRONG, flags, version, 2))
        with pytest.raises(DiffractionError, match="names vertex 4, but there are only 4"):
            check_mesh(file, "serialized", number)


def ply(faces: np.ndarray, form: str, index: str, extra: bool) -> bytes:
    """Return a PLY file, with an element in between and properties beside the list if `extra`."""
    more = "element edge 1\nproperty short a\n" if extra else ""
    beside = "property uchar a\n" if extra else ""
    header = (
        f"ply\nformat {form} 1.0\ncomment end_header\nelement vertex 4\nproperty float x\n"
        f"property double y\nproperty float z\n{more}element face {len(faces)}\n{beside}"
        f"property list uchar {index} vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [f"{x} {y} {z}" for x, y, z in POSITIONS] + ["7"] * extra
        rows += [f"{'9 ' if extra else ''}3 {a} {b} {c}" for a, b, c in faces]
        return header + "\n".join(rows).encode()
    order = ">" if "big" in form else "<"
    code = {"int": "i", "uint": "I", "ushort": "H"}[index]
    body = b"".join(struct.pack(f"{order}fdf", *row) for row in POSITIONS)
    body += struct.pack(f"{order}h", 7) if extra else b""
    for row in faces:
        body += (b"\x09" if extra else b"") + struct.pack(f"{order}B3{code}", 3, *row)
    return header + body


@pytest.mark.parametrize("extra", [False, True])
@pytest.mark.parametrize("index", ["int", "uint", "ushort"])
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_meshes_are_read_as_mitsuba_reads_them(
    form: str, index: str, extra: bool, tmp_path: Path, some_variant: str
) -> None:
    file = tmp_path / "mesh.ply"
    file.write_bytes(ply(FACES, form, index, extra))
    mesh = mi.load_dict({"type": "ply", "filename": str(file)})
    check_mesh(file, "ply")
    assert mesh.face_count() == 2
    file.write_bytes(ply(WRONG, form, index, extra))
    with pytest.raises(DiffractionError, match="names vertex 4, but there are only 4"):
        check_mesh(file, "ply")


@pytest.mark.parametrize("left", [20, 100, 140])
def test_a_header_without_an_end_is_refused(left: int, tmp_path: Path) -> None:
    """Mitsuba reads on beyond the end of the file, which ends the process."""
    file = tmp_path / "mesh.ply"
    file.write_bytes(ply(FACES, "ascii", "int", False).replace(b"comment end_header\n", b"")[:left])
    with pytest.raises(DiffractionError, match="header has no end"):
        check_mesh(file, "ply")


@pytest.mark.parametrize("number", [0, 1])
def test_a_serialized_mesh_that_is_cut_short_is_refused(number: int, tmp_path: Path) -> None:
    """Mitsuba ends the process at some of these lengths."""
    file = tmp_path / "mesh.serialized"
    whole = serialized(FACES, 0x1000, 4, 1 + number)
    for length in range(4, len(whole) - 20 - 8 * number):
        file.write_bytes(whole[:length])
        with pytest.raises(DiffractionError, match="damaged"):
            check_mesh(file, "serialized", number)
