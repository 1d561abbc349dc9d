"""Whether a mesh has the tangents that a patch needs, and where a field of directions breaks."""

from __future__ import annotations

import struct
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.scene.orientation.directions import direction_field
from mitsuba_diffraction.scene.orientation.mesh_files import load_mesh, write_ply
from mitsuba_diffraction.scene.orientation.tangents import check_tangents
from mitsuba_diffraction.scene.orientation.trimesh import TriangleMesh, grid_faces, oriented_mesh
from tests.support import ROOT
from tests.support.meshes import ball, obj_of, ring, tube
from tests.support.refusals import refused

PLY = b"""ply
format binary_little_endian 1.0
element vertex 1
property float x
property float y
property float z
end_header
"""

Arrays = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _sheet(n: int = 8) -> Arrays:
    """A flat square sheet with texture coordinates x, y."""
    x, y = (g.ravel() for g in np.meshgrid(*2 * [np.linspace(0, 1, n + 1)], indexing="ij"))
    positions = np.stack([x, y, 0 * x], axis=1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], positions.shape)
    faces = grid_faces(np.arange((n + 1) ** 2).reshape(n + 1, n + 1))
    return positions, normals, positions[:, :2].copy(), faces


#: Change of the sheet's texture coordinates, what is found, and words of the only problem.
SHEETS = {
    "plain": (lambda x, u, v: (u, v), {"triangles": 128, "degenerate": 0, "mirrored": 0,
                                       "turning": 0, "stretch": 1}, ""),
    "stretched": (lambda x, u, v: (u / 3, v), {"stretch": 3}, None),
    # as of OBJ files, of which Mitsuba flips v
    "mirrored": (lambda x, u, v: (u, 1 - v), {"mirrored": 0}, ""),
    "half mirrored": (lambda x, u, v: (u, np.abs(v - 0.5)), {"mirrored": 0.5}, "mirrored"),
    # two columns of cells, and one triangle of each cell in the column before
    "collapsed": (lambda x, u, v: np.where(x > 0.7, 0.5, [u, v]), {"degenerate": 2.5 / 8},
                  "without area"),
}  # fmt: skip


@pytest.mark.parametrize(("change", "found", "words"), SHEETS.values(), ids=SHEETS)
def test_a_sheet_is_reported_as_its_coordinates_are(change, found, words) -> None:
    positions, normals, uv, faces = _sheet()
    changed = np.stack(change(positions[:, 0], *uv.T), axis=1)
    report = check_tangents(TriangleMesh(positions, normals, changed, faces))
    assert {name: getattr(report, name) for name in found} == pytest.approx(found)
    if words is not None:
        assert report.usable is not bool(words) or words == "mirrored"
        assert any(words in line for line in report.problems()) == bool(words)


def test_without_texture_coordinates_there_is_no_direction() -> None:
    positions, normals, _, faces = _sheet()
    report = check_tangents(TriangleMesh(positions, normals, None, faces))
    (problem,) = report.problems()
    assert not report.usable
    assert "no texture coordinates" in problem


@pytest.mark.parametrize("corner", ["{0}//{1}", "{0}/{0}/{1}"])
def test_normals_without_length_are_rebuilt_with_a_note(tmp_path, some_variant, corner) -> None:
    file = tmp_path / "a.obj"
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    lines = [f"v {x} {y} 0" for x, y in square]
    if "/{0}/" in corner:
        lines += [f"vt {x} {y}" for x, y in square]
    corners = [corner.format(v, 1 + (v > 2)) for v in (1, 2, 3, 4)]
    lines += ["vn 0 0 1", "vn 0 0 0", "f " + " ".join(corners[:3]),
              "f " + " ".join(corners[n] for n in (0, 2, 3))]  # fmt: skip
    file.write_text("\n".join(lines) + "\n")
    with pytest.warns(DiffractionWarning, match="length 0; all are rebuilt"):
        mesh = load_mesh(file)
    assert mesh.normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(mesh.normals), 1)))
    assert len(mesh.faces) == 2
    assert (mesh.uv is not None) == ("/{0}/" in corner)


@pytest.mark.parametrize("name", ["elaphe", "xenopeltis"])
def test_the_snakes_are_usable(name: str) -> None:
    report = check_tangents(load_mesh(ROOT / "scenes" / "meshes" / f"{name}.ply"))
    assert report.usable
    assert report.problems() == []


def test_a_refused_mesh_leaves_later_scenes_alone(tmp_path: Path, some_variant: str) -> None:
    (tmp_path / "empty.ply").write_bytes(PLY + bytes(12))
    with pytest.raises(DiffractionError, match="no triangles") as kept:
        load_mesh(tmp_path / "empty.ply")
    # kernels are compiled for all shapes alive, which an error kept must not count among
    scene = mi.load_dict({"type": "scene", "a": {"type": "rectangle"}, "b": {"type": "sphere"}})
    hit = scene.ray_intersect(mi.Ray3f(mi.Point3f(0, 0, 5), mi.Vector3f(0, 0, -1)))
    assert float(hit.t[0]) == pytest.approx(4.0)
    del kept


@given(st.binary(max_size=300))
@settings(max_examples=40)
def test_any_bytes_after_a_ply_header_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = tmp_path_factory.mktemp("ply") / "mesh.ply"
    path.write_bytes(b"ply\nformat binary_little_endian 1.0\n" + content)
    refused(lambda: load_mesh(path), "")


def test_a_written_mesh_reads_back_without_vertices_of_no_triangle(tmp_path: Path) -> None:
    """One far away would shrink the mesh on the stage."""
    positions, normals, uv, faces = _sheet(2)
    turns = np.tile([0.0, 1.0], (len(positions), 1))
    arrays = (np.insert(a, 3, 1000.0, axis=0) for a in (positions, normals, uv))
    mesh = TriangleMesh(*arrays, faces + (faces >= 3), np.insert(turns, 3, 0.5, axis=0))
    write_ply(tmp_path / "sheet.ply", mesh, "a sheet")
    read = load_mesh(tmp_path / "sheet.ply")
    arrays = read.positions, read.normals, read.uv, read.faces
    for before, after in zip((positions, normals, uv, faces), arrays, strict=True):
        np.testing.assert_array_equal(before, after)
    np.testing.assert_array_equal(read.orientation, turns)


def test_other_attributes_may_have_any_name(tmp_path: Path) -> None:
    positions, normals, uv, faces = _sheet(2)
    turns = np.tile([0.0, 1.0], (len(positions), 1))
    write_ply(file := tmp_path / "a.ply", TriangleMesh(positions, normals, uv, faces, turns))
    file.write_bytes(file.read_bytes().replace(b"float t\n", b"float \xe9_0\n"))  # not UTF-8
    np.testing.assert_array_equal(load_mesh(file).orientation, turns)


@pytest.mark.parametrize("order", ["ascii", "<", ">"])
def test_polygons_are_cut_into_triangles(order: str, tmp_path: Path) -> None:
    """A quad and a pentagon, faces with a colour of their own, as an OBJ of the same has them."""
    corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 2)]
    polygons = [(0, 1, 2, 3), (0, 1, 2, 4, 3)]
    kind = {"ascii": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = (
        f"ply\nformat {kind} 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
        "property double z\nelement face 2\nproperty uchar red\nproperty list uchar int "
        "vertex_indices\nend_header\n"
    ).encode()
    if order == "ascii":
        rows = [" ".join(map(str, [*corner, 0])) for corner in corners]
        rows += [" ".join(map(str, [7, len(p), *p])) for p in polygons]
        body = "\n".join(rows).encode() + b"\n"
    else:
        body = b"".join(struct.pack(f"{order}ffd", *corner, 0) for corner in corners)
        body += b"".join(
            struct.pack(f"{order}BB{len(p)}i", 7, len(p), *p) for p in polygons
        )  # fmt: skip
    (tmp_path / "polygons.ply").write_bytes(header + body)
    obj_of(tmp_path / "polygons.obj", [(x, y, 0.0) for x, y in corners], polygons)
    ours, theirs = (load_mesh(tmp_path / f"polygons.{kind}") for kind in ("ply", "obj"))
    np.testing.assert_array_equal(ours.positions[ours.faces], theirs.positions[theirs.faces])
    # cut short, it is refused as any damaged file
    (tmp_path / "short.ply").write_bytes((header + body)[:-8])
    with pytest.raises(DiffractionError, match="cannot be read"):
        load_mesh(tmp_path / "short.ply")


def report_of(positions, normals, faces, along, smoothing=0.03):
    """What is found on a mesh that `tangents` makes."""
    field = direction_field(positions, normals, faces, along, smoothing=smoothing)
    mesh = oriented_mesh(positions, normals, faces, field.directions)
    return check_tangents(mesh)


#: Of a ring.
RADII = (1.0, 0.42)


# a field that is smooth over 0.28 breaks where it is smallest: measured, 0.06 further in
@pytest.mark.parametrize(("smoothing", "moved"), [(0.001, 0.0), (0.03, 0.0), (0.1, 0.06)])
@pytest.mark.parametrize("cells", [(24, 16), (60, 40)])
def test_a_ring_along_its_axis_breaks_along_two_circles(cells, smoothing, moved):
    report = report_of(*ring(*cells, radii=RADII), "z", smoothing)
    # half a cell beside the circles of radius 1, which are polygons
    assert report.broken < 4 * np.pi
    assert report.broken == pytest.approx(4 * np.pi, rel=0.42 * np.pi / cells[1] + 0.01 + moved)
    assert report.size == pytest.approx(2.84)
    assert not report.usable
    assert "lines of 1" in report.problems()[0]


@pytest.mark.parametrize("cells", [(12, 1), (48, 20)])
def test_a_tube_across_its_axis_breaks_along_two_lines(cells):
    # in the middle of a strip of quadrangles, which are cut into triangles
    assert report_of(*tube(*cells), "x").broken == pytest.approx(6.0, rel=1e-6)


@pytest.mark.parametrize("mesh", [ring(48, 24, radii=RADII), tube(48, 20)])
def test_a_smooth_field_does_not_break(mesh):
    report = report_of(*mesh, "smooth")
    assert report.broken == 0.0
    assert report.usable
    assert report.problems() == []
    assert report.stretch == pytest.approx(1)  # of coordinates that are made with the field


@pytest.mark.parametrize("cells", [20, 32])
@pytest.mark.parametrize("along", ["z", "smooth", "body"])
def test_singular_points_are_no_lines(cells, along):
    assert report_of(*ball(cells), along).broken == 0.0


@pytest.mark.parametrize("cells", [8, 64])
def test_a_seam_of_the_texture_is_as_long_however_fine_the_mesh(cells):
    positions, normals, uv, faces = _sheet(cells)
    right = positions[faces].mean(axis=1)[:, 0] > 0.5
    faces[right] += len(positions)  # where u runs along y
    uv = np.concatenate([uv, np.stack([uv[:, 1], -uv[:, 0]], axis=1)])
    two = np.tile(positions, (2, 1)), np.tile(normals, (2, 1))
    report = check_tangents(TriangleMesh(*two, uv, faces))
    assert report.broken == pytest.approx(1.0)
    # one triangle in each cell on both sides of the seam
    assert report.turning == pytest.approx(2 * 0.5 / cells)
    assert not report.usable
    # turned back by the orientation, nothing is left of it
    back = np.repeat([[1.0, 0.0], [0.0, -1.0]], len(positions), axis=0)
    assert check_tangents(TriangleMesh(*two, uv, faces, back)).usable
