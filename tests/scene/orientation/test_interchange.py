"""Meshes of glTF and USD against the same mesh in PLY."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from PIL import EpsImagePlugin, Image

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.fitted_mesh import fit_of
from mitsuba_diffraction.scene.orientation.mesh_files import load_mesh
from mitsuba_diffraction.scene.orientation.trimesh import grid_faces
from tests.support.hostile import postscript
from tests.support.meshes import obj_of, ply_text

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
    assert mesh.own_normals
    assert fit_of(mesh, file).up == ("z" if ".usd" in suffix else "y")  # a stage's own


@pytest.mark.parametrize(("write", "suffix"), WRITERS[::2])
def test_without_coordinates_there_are_none(
    tmp_path: Path, write: Callable[..., None], suffix: str
) -> None:
    write(tmp_path / f"sheet{suffix}", uv=False)
    assert load_mesh(tmp_path / f"sheet{suffix}").uv is None


def _edited_gltf(file: Path, edit: Callable[[dict[str, Any]], None]) -> None:
    """Write a glTF file whose document is edited."""
    write_gltf(file)
    document = json.loads(file.read_text("utf-8"))
    edit(document)
    file.write_text(json.dumps(document), encoding="utf-8")


def test_coordinates_are_kept_without_a_material(tmp_path: Path) -> None:
    def edit(document: dict[str, Any]) -> None:
        document.pop("materials", None)
        document["meshes"][0]["primitives"][0].pop("material", None)

    _edited_gltf(tmp_path / "bare.gltf", edit)
    uv = load_mesh(tmp_path / "bare.gltf").uv
    assert uv is not None
    np.testing.assert_allclose(uv, np.stack([U, 1.0 - V], axis=1), atol=1e-6)


def quantized(document: dict[str, Any]) -> None:
    """Integers stand for fractions."""
    number = document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]
    document["accessors"][number]["normalized"] = True


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (
            lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]),
            "by Draco.*ion off",
        ),
        (lambda d: d.update(extensionsRequired=["EXT_meshopt_compression"]), "meshopt.*ion off"),
        (quantized, "TEXCOORD_0 .*without quantization"),
    ],
)
def test_what_is_packed_is_refused_with_the_way_out(tmp_path: Path, edit: Any, words: str) -> None:
    _edited_gltf(tmp_path / "packed.gltf", edit)
    with pytest.raises(DiffractionError, match=words):
        load_mesh(tmp_path / "packed.gltf")


#: A cube from −1 to 1, whose normals at the corners are (±1, ±1, ±1) / √3 by symmetry.
CORNERS = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def write_cube(file: Path) -> None:
    """Write a cube of four-sided polygons without normals."""
    if file.suffix == ".usda":
        listed = ", ".join(f"({x}, {y}, {z})" for x, y, z in CORNERS)
        text = (
            '#usda 1.0\n(\n    upAxis = "Y"\n)\ndef Mesh "cube"\n{\n'
            f"    int[] faceVertexCounts = {[4] * 6}\n"
            f"    int[] faceVertexIndices = {[corner for side in SIDES for corner in side]}\n"
            f"    point3f[] points = [{listed}]\n}}\n"
        )
        file.write_text(text, encoding="utf-8")
    elif file.suffix == ".obj":  # each polygon has corners of its own
        obj_of(file, np.array(CORNERS)[SIDES].reshape(-1, 3), np.arange(24).reshape(6, 4))
    else:
        file.write_text(ply_text(CORNERS, SIDES, "xyz"))


@pytest.mark.parametrize("suffix", [".usda", ".ply", ".obj"])
def test_meshes_without_normals_get_smooth_ones(
    tmp_path: Path, suffix: str, some_variant: str
) -> None:
    if suffix == ".usda":
        pytest.importorskip("pxr.Usd")
    file = tmp_path / f"cube{suffix}"
    write_cube(file)
    mesh = load_mesh(file)
    assert not mesh.own_normals
    np.testing.assert_allclose(mesh.normals, mesh.positions / np.sqrt(3.0), atol=1e-6)


@pytest.mark.parametrize(("sides", "sharp"), [(5, True), (7, False)])
def test_edges_of_sixty_degrees_between_parts_of_the_texture_are_sharp(
    tmp_path: Path, sides: int, sharp: bool, some_variant: str
) -> None:
    """A tube of a few sides, with texture coordinates of its own on each."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    places = [(np.cos(a), np.sin(a), z) for z in (0, 1) for a in angles]
    ends = [(n, (n + 1) % sides) for n in range(sides)]
    polygons = [(a, b, b + sides, a + sides) for a, b in ends]
    uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
    obj_of(tmp_path / "tube.obj", places, polygons, uv, [range(4)] * sides)
    mesh = load_mesh(tmp_path / "tube.obj")
    outwards = (mesh.normals * mesh.positions)[:, :2].sum(axis=1)  # of unit vectors
    np.testing.assert_allclose(outwards, np.cos(np.pi / sides) if sharp else 1.0, atol=1e-6)


SECRETS = ["../secret.bin", "{outside}/secret.bin", "link.bin", "%2e%2e/secret.bin", "pipe.bin"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a link and a pipe; beside it lies a file that nothing in it may name."""
    (tmp_path / "secret.bin").write_bytes(bytes(4096))
    folder = tmp_path / "mesh"
    folder.mkdir()
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    os.mkfifo(folder / "pipe.bin")
    return folder


def textured_gltf(folder: Path) -> Path:
    """Write a sheet with a picture, and a buffer beside it; return its file."""
    trimesh = pytest.importorskip("trimesh")
    picture = Image.new("RGB", (2, 2), "red")
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=picture)
    visual = trimesh.visual.TextureVisuals(uv=np.stack([U, V], axis=1), material=material)
    mesh = trimesh.Trimesh(POSITIONS, FACES, visual=visual, process=False)
    file = folder / "sheet.gltf"
    for name, content in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
        (file if name.endswith(".gltf") else folder / name).write_bytes(content)
    return file


def pigmented(file: Path) -> None:
    """Load a surface over the pigment of a file."""
    flat = md.HeightField(np.zeros((8, 8)), 1.0, periodic=True)
    mi.load_dict(md.bsdf_dict(flat, material="keratin", pigment=str(file)))


@pytest.mark.usefixtures("some_variant")
@pytest.mark.parametrize("name", SECRETS)
@pytest.mark.parametrize("part", ["buffers", "images"])
def test_gltf_reads_files_of_its_own_folder_alone(folder: Path, part: str, name: str) -> None:
    file = textured_gltf(folder)
    assert len(load_mesh(file).faces) == len(FACES)
    document = json.loads(file.read_text())
    entry = document[part][0]
    entry.pop("bufferView", None)
    entry["uri"] = name.format(outside=folder.parent)
    file.write_text(json.dumps(document))
    # a mesh needs no pictures, which are read for pigments alone
    read = load_mesh if part == "buffers" else pigmented
    with pytest.raises((DiffractionError, RuntimeError), match=r"outside of its folder|is a pipe"):
        read(file)


@pytest.mark.usefixtures("some_variant")
def test_pictures_in_gltf_run_no_program(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", lambda *a, **k: calls.append(a))
    postscript(folder / "a.eps")
    file = textured_gltf(folder)
    document = json.loads(file.read_text())
    document["images"][0] = {"uri": "a.eps", "mimeType": "image/png"}
    file.write_text(json.dumps(document))
    load_mesh(file)
    with pytest.raises(RuntimeError, match="none of PNG"):
        pigmented(file)
    assert calls == []


USD_NAMES = ["../secret.usda", "{outside}/secret.usda", "./link.usda", "./pipe.usda", '`"a"`']


@pytest.mark.parametrize("name", USD_NAMES)
@pytest.mark.parametrize("nested", [False, True])
def test_usd_reads_files_of_its_own_folder_alone(folder: Path, name: str, nested: bool) -> None:
    pytest.importorskip("pxr.Usd")
    write_usd(folder.parent / "secret.usda")
    (folder / "link.usda").symlink_to(folder.parent / "secret.usda")
    os.mkfifo(folder / "pipe.usda")
    write_usd(folder / "part.usda")
    file = folder / "sheet.usda"
    layers = "#usda 1.0\n(\n    subLayers = [@{}@]\n)\n"
    file.write_text(layers.format("./part.usda"))
    assert len(load_mesh(file).faces) == len(FACES)
    (folder / "part.usda").write_text(layers.format(name.format(outside=folder.parent)))
    if not nested:
        (folder / "part.usda").rename(file)
    with pytest.raises(DiffractionError, match=r"outside of its folder|is a pipe|an expression"):
        load_mesh(file)
