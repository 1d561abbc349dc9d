"""Meshes of glTF and USD against the same mesh in PLY."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.fitted_mesh import fit_of
from mitsuba_diffraction.scene.orientation.mesh_files import has_own_normals, load_mesh
from mitsuba_diffraction.scene.orientation.trimesh import grid_faces

# a bent sheet, of which no axis and no side looks like another
U, V = (g.ravel() for g in np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 3), indexing="ij"))
POSITIONS = np.stack([2.0 * U, V, 0.3 * U * U], axis=1)
NORMALS = np.stack([-0.3 * U, 0.0 * U, 1.0 + 0.0 * U], axis=1)
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
FACES = grid_faces(np.arange(12).reshape(4, 3))
#: Placement in the file's scene, mirrored: scale, then shift.
SCALE, SHIFT = np.array([1.0, -2.0, 3.0]), np.array([5.0, 6.0, 7.0])


def write_gltf(file: Path, uv: bool = True) -> None:
    trimesh = pytest.importorskip("trimesh")
    visual = trimesh.visual.TextureVisuals(uv=np.stack([U, V], axis=1)) if uv else None
    mesh = trimesh.Trimesh(POSITIONS, FACES, vertex_normals=NORMALS, visual=visual, process=False)
    place = np.diag([*SCALE, 1.0])
    place[:3, 3] = SHIFT
    scene = trimesh.Scene()
    scene.add_geometry(mesh, transform=place)
    scene.export(file, include_normals=True)


def write_usd(file: Path, uv: bool = True) -> None:
    usd, geometry = (pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom"))
    kinds = pytest.importorskip("pxr.Sdf").ValueTypeNames
    stage = usd.Stage.CreateNew(str(file))
    geometry.SetStageUpAxis(stage, "Z")
    outer = geometry.Xform.Define(stage, "/outer")
    outer.AddTranslateOp().Set(tuple(SHIFT))
    outer.AddScaleOp().Set(tuple(SCALE))
    mesh = geometry.Mesh.Define(stage, "/outer/sheet")
    mesh.GetPointsAttr().Set([tuple(p) for p in POSITIONS])
    mesh.GetNormalsAttr().Set([tuple(n) for n in NORMALS])
    # polygons of four corners, and the texture coordinates at the corners
    quads = [[n, n + 3, n + 4, n + 1] for n in range(9) if n % 3 < 2]
    mesh.GetFaceVertexCountsAttr().Set([4] * len(quads))
    corners = [corner for quad in quads for corner in quad]
    mesh.GetFaceVertexIndicesAttr().Set(corners)
    if uv:
        st = geometry.PrimvarsAPI(mesh).CreatePrimvar("st", kinds.TexCoord2fArray, "faceVarying")
        st.Set([(U[c], V[c]) for c in corners])
    stage.Save()


WRITERS = [
    (write_gltf, ".glb"), (write_gltf, ".gltf"), (write_usd, ".usda"), (write_usd, ".usdc")
]  # fmt: skip


@pytest.mark.parametrize(("write", "suffix"), WRITERS)
def test_a_mesh_comes_placed_with_normals_and_coordinates(
    tmp_path: Path, write: Callable[..., None], suffix: str
) -> None:
    file = tmp_path / f"sheet{suffix}"
    write(file)
    mesh = load_mesh(file)
    assert mesh.normals is not None
    assert mesh.uv is not None
    u = mesh.uv[:, 0]
    v = 1.0 - mesh.uv[:, 1]  # Mitsuba's v runs downwards
    expected = np.stack([2.0 * u, v, 0.3 * u * u], axis=1) * SCALE + SHIFT
    np.testing.assert_allclose(mesh.positions, expected, atol=1e-5)
    normals = np.stack([-0.3 * u, 0.0 * u, 1.0 + 0.0 * u], axis=1) / SCALE
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.normals, normals, atol=1e-5)
    # faces run counter-clockwise where the normal comes towards the eye, mirrored or not
    a, b, c = mesh.positions[mesh.faces].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    assert (np.sum(area * mesh.normals[mesh.faces[:, 0]], axis=1) > 0.0).all()
    # the whole sheet, each part once
    np.testing.assert_allclose(np.abs(area[:, 2]).sum() / 2.0, 4.0, rtol=1e-5)
    assert has_own_normals(file)


@pytest.mark.parametrize(("write", "suffix"), WRITERS[::2])
def test_without_coordinates_there_are_none(
    tmp_path: Path, write: Callable[..., None], suffix: str
) -> None:
    write(tmp_path / f"sheet{suffix}", uv=False)
    assert load_mesh(tmp_path / f"sheet{suffix}").uv is None


def test_the_axis_of_a_stage_is_its_own(tmp_path: Path) -> None:
    write_usd(tmp_path / "sheet.usda")
    mesh = load_mesh(tmp_path / "sheet.usda")
    assert fit_of(mesh.positions, tmp_path / "sheet.usda").up == "z"


@pytest.mark.parametrize(
    ("name", "content", "package"),
    [
        ("bad.glb", b"glTF\2\0\0\0\xff\0\0\0nothing", "trimesh"),
        ("bad.gltf", b'{"asset": {"version": "2.0"}, "meshes": 3}', "trimesh"),
        ("empty.gltf", b'{"asset": {"version": "2.0"}}', "trimesh"),
        ("lost.gltf", b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin"}]}', "trimesh"),
        ("bad.usda", b"#usda 1.0\n nothing", "pxr"),
        ("bad.usdz", b"PK nothing", "pxr"),
        ("empty.usda", b"#usda 1.0\n", "pxr"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_one_line(
    tmp_path: Path, name: str, content: bytes, package: str
) -> None:
    pytest.importorskip(package)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DiffractionError, match=name) as caught:
        load_mesh(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_missing_package_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    blocked: Any = None
    monkeypatch.setitem(sys.modules, "trimesh", blocked)
    (tmp_path / "a.glb").write_bytes(b"glTF")
    with pytest.raises(DiffractionError, match="extra gltf"):
        load_mesh(tmp_path / "a.glb")
