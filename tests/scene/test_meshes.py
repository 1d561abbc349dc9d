"""Arrays of meshes are read alike from Mitsuba 3.9's flat buffers and from 3.10's tensors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.scene.meshes import has_texcoords, mesh_arrays

# a square of two triangles
POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
NORMALS = np.tile(np.float32([0, 0, 1]), (4, 1))
UV = np.ascontiguousarray(POSITIONS[:, :2])
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def mesh_of(**values: Any) -> Any:
    """An object whose methods return these values."""
    return SimpleNamespace(**{name: lambda value=value: value for name, value in values.items()})


#: The same square, in every way in which Mitsuba presents it.
SQUARES = {
    "3.9": mesh_of(
        vertex_positions_buffer=POSITIONS.ravel(), vertex_normals_buffer=NORMALS.ravel(),
        vertex_texcoords_buffer=UV.ravel(), faces_buffer=FACES.ravel(),
        has_vertex_normals=True, has_vertex_texcoords=True,
    ),
    "3.10": mesh_of(
        positions=POSITIONS, normals=NORMALS, texcoords=UV, faces=FACES,
        position_index=np.empty(0, np.uint32), normal_index=np.empty(0, np.uint32),
        has_normals=True, has_texcoords=True,
    ),
    "3.10, shared": mesh_of(
        positions=POSITIONS[::-1], normals=NORMALS[:1], texcoords=UV, faces=FACES,
        position_index=np.uint32([3, 2, 1, 0]), normal_index=np.zeros(4, np.uint32),
        has_normals=True, has_texcoords=True,
    ),
}  # fmt: skip


@pytest.mark.parametrize("version", SQUARES)
def test_arrays_have_a_row_for_each_vertex_and_face(version: str):
    arrays = mesh_arrays(SQUARES[version])
    for values, expected in zip(arrays[:4], (POSITIONS, NORMALS, UV, FACES), strict=True):
        np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize(
    "names",
    [
        ("vertex_positions_buffer", "faces_buffer", "has_vertex_normals", "has_vertex_texcoords"),
        ("positions", "faces", "has_normals", "has_texcoords"),
    ],
    ids=["3.9", "3.10"],
)
def test_bare_mesh_has_neither_normals_nor_texture_coordinates(names: tuple[str, ...]):
    bare = mesh_of(**dict(zip(names, (POSITIONS, FACES, False, False), strict=True)))
    assert not has_texcoords(bare)
    assert mesh_arrays(bare)[1:3] == (None, None)
    np.testing.assert_array_equal(mesh_arrays(bare).faces, FACES)


@pytest.mark.parametrize("name", ["scalar_rgb", "llvm_ad_rgb"])
def test_mesh_of_the_installed_mitsuba_is_read(name: str):
    mi.set_variant(name)
    arrays = mesh_arrays(mi.load_dict({"type": "cube"}))
    assert arrays.positions.shape == (24, 3)
    assert arrays.faces.shape == (12, 3)
    assert arrays.normals is not None
    assert arrays.uv is not None
    # unit normals across the faces of a cube from −1 to 1
    across = np.einsum(
        "fc,fc->f", arrays.positions[arrays.faces[:, 0]], arrays.normals[arrays.faces[:, 0]]
    )
    np.testing.assert_allclose(across, 1.0, rtol=1e-6)
